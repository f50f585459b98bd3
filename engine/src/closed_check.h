// SPDX-License-Identifier: Apache-2.0
// The check of a mesh that has nothing wrong with it.
#pragma once

#include <optional>

#include "fibrolite/mesh_layers.h"

namespace fibrolite {

/// What check() says of a mesh whose vertices all lie apart, each with one closed fan of 3 to 16 triangles; nothing of
/// any other, which it may find out before the last layer. Cost: O(n) time, parallel; 40 bytes a triangle of two
/// layers.
/// @throws Error Cancelled, Io.
[[nodiscard]] std::optional<MeshCheck> check_closed(const MeshLayers& layers, const Context& context);

}  // namespace fibrolite
