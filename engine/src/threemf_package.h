// SPDX-License-Identifier: Apache-2.0
// What every 3MF package holds beside its model.
#pragma once

#include "zip_writer.h"

namespace fibrolite {

/// Name of the model's own entry.
inline constexpr const char* model_part_3mf = "3D/3dmodel.model";
/// The entries that lead to it.
void begin_3mf(ZipWriter& zip);

}  // namespace fibrolite
