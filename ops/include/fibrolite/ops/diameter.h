// SPDX-License-Identifier: GPL-3.0-or-later
// The shape diameter function on a proxy surface.
#pragma once

#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/frame.h"
#include "fibrolite/mesh.h"
#include "fibrolite/solid.h"

namespace fibrolite {

/// A coarse, clean picture of the model on which everything that must not depend on the fine voxel is decided.
struct Proxy {
  Solid solid;    ///< Level set at the proxy voxel, band 3 voxels outside, whole interior signed.
  Mesh surface;   ///< Its surface: closed, outward, about `triangles` faces.
  Frame frame{};  ///< Whose coordinates both are given in.
};
struct ProxyParams {
  Frame frame{};          ///< Whose coordinates the proxy is made in: its lattice lies along these axes.
  int triangles = 40000;  ///< Aimed at; up to four times as many where thin limbs would be lost; 1000 to 200000.
};
/// The proxy voxel follows from the model's area alone, never from the fine voxel.
/// @throws Error BadInput: no volume at the proxy's voxel.
[[nodiscard]] Proxy make_proxy(const Mesh& model, const ProxyParams& params = {}, const Context& context = {});

struct DiameterParams {
  double cone_rad = 2.0943951023931953;  ///< Opening of the ray cone; paper Sec. 4.1 (120 degrees).
  int rays = 25;
  double alpha = 4;  ///< Normalisation of nsdf; paper Sec. 4.1.
};
struct DiameterField {
  std::vector<double> diameter_mm;  ///< One per face of the surface, smoothed.
  std::vector<double> normalized;   ///< nsdf in [0, 1], Sec. 4.1; 0.1 % at either end are 0 or 1.
};
/// @throws Error BadInput: empty or open surface. Cost: about 0.1 ms per face. Source: Shapira et al. 2008; CGAL's
/// sdf_values.
[[nodiscard]] DiameterField diameter(const Mesh& surface, const DiameterParams& params = {},
                                     const Context& context = {});

}  // namespace fibrolite
