// SPDX-License-Identifier: GPL-3.0-or-later
// The closed list of infills. Names, help, JSON keys and typed tests come from this list.
#pragma once

#include <array>
#include <string_view>

namespace fibrolite {

/// What a whole run fills the body with.
enum class InfillKind { Hybrid, Tcs, Mfs, Solid, Gyroid, Shell };

struct InfillName {
  InfillKind kind;
  std::string_view name, help;
};
inline constexpr std::array<InfillName, 6> infill_names{{
    {InfillKind::Hybrid, "hybrid", "fibres in columns, crystal in bulk, joints between (the paper's method)"},
    {InfillKind::Tcs, "tcs", "tetrahedral crystal everywhere, no partition"},
    {InfillKind::Mfs, "mfs", "muscle fibres everywhere, no partition"},
    {InfillKind::Solid, "solid", "filled"},
    {InfillKind::Gyroid, "gyroid", "gyroid walls everywhere, no partition: to compare with"},
    {InfillKind::Shell, "shell", "nothing: the shell alone, to compare with"},
}};

}  // namespace fibrolite
