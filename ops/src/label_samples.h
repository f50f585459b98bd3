// SPDX-License-Identifier: GPL-3.0-or-later
// From pieces of the proxy to labels of space.
#pragma once

#include <vector>

#include "decompose.h"
#include "label_field.h"

namespace fibrolite {

/// Every sample of the proxy's lattice with its label and its distance to the cuts nearby. `name`: label of each piece.
[[nodiscard]] LabelSamples make_label_samples(const Anatomy& anatomy, const CutPieces& pieces,
                                              const std::vector<int>& name);

}  // namespace fibrolite
