// SPDX-License-Identifier: Apache-2.0
// A tetrahedral mesh with fields, for ParaView and other readers of VTK's XML format.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// Numbers at the nodes or the tetrahedra of a mesh: `components` of them each, one after the other.
struct VtuField {
  std::string name;
  int components = 1;          ///< 1 a scalar, 3 a vector, 6 a symmetric tensor (xx yy zz xy yz xz), 9 a tensor.
  std::vector<double> values;  ///< Finite.
};
/// An unstructured grid of quadratic tetrahedra, binary, little-endian, whole or absent. `nodes`: fields with a value
/// per node; `tets`: with one per tetrahedron. Lengths in mm.
/// @throws Error Io; BadInput: a field of the wrong size, or with a value that is no number; Cancelled.
/// Source: VTK file formats, XML unstructured grid, appended raw data.
void write_vtu(const std::filesystem::path& path, const TetMesh& mesh, const std::vector<VtuField>& nodes,
               const std::vector<VtuField>& tets, const Context& context = {});

}  // namespace fibrolite
