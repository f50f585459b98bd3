// SPDX-License-Identifier: Apache-2.0
// Stress at a point.
#pragma once

#include <array>

namespace fibrolite {

/// xx yy zz xy yz zx, MPa; tension is positive.
using StressTensor = std::array<double, 6>;
/// Von Mises equivalent stress, MPa.
[[nodiscard]] double von_mises(const StressTensor& stress);
/// The three principal stresses, MPa, largest first.
[[nodiscard]] std::array<double, 3> principal_stresses(const StressTensor& stress);

}  // namespace fibrolite
