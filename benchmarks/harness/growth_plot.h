// SPDX-License-Identifier: GPL-3.0-or-later
// Time and memory of a series of halved voxels, as a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace fibrolite::bench {

/// An .svg of the cases "peer-tcs VOXEL" of a bench.json, beside the floor at the same voxel, and of "peer-tcs VOXEL
/// slabs": CPU seconds and peak MB over the voxel, both axes logarithmic, with a dashed line that grows by four when
/// the voxel is halved. Empty: there are not two of them.
[[nodiscard]] std::string growth_plot(const nlohmann::json& cases);

}  // namespace fibrolite::bench
