// SPDX-License-Identifier: GPL-3.0-or-later
// What the generator of the bundled assets can make. Private to fibrolite-assets and the tests.
#pragma once

#include <cstdint>

#include "fibrolite/image.h"

namespace fibrolite {

/// The seed of the committed assets/textures/muscle.png.
inline constexpr std::uint64_t muscle_seed = 20190;

/// A synthetic cross-section of skeletal muscle, 1024 x 1024: bright irregular fibres, thin dark membranes, bundles
/// between wider septa, nuclei, uneven light, blur and noise. Write it with write_gray() of micrograph.h. The same bits
/// for the same seed.
[[nodiscard]] GrayImage muscle_micrograph(std::uint64_t seed);

/// The number of fibres drawn by muscle_micrograph(seed) of which more than a quarter of the mean area shows.
[[nodiscard]] int muscle_fibre_count(std::uint64_t seed);

}  // namespace fibrolite
