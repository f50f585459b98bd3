// SPDX-License-Identifier: GPL-3.0-or-later
// The bundled models, made from smoothly blended primitives.
#pragma once

#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"

namespace fibrolite {

/// Names of the bundled models, in the order of assets/README.md.
[[nodiscard]] std::vector<std::string> bundled_model_names();
/// Closed, outward, mm, z up, standing on z = 0 and centred on the z axis. The same bits every time.
/// @throws Error BadInput: no such name.
[[nodiscard]] Mesh bundled_model(const std::string& name, const Context& context = {});

}  // namespace fibrolite
