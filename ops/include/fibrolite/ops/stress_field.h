// SPDX-License-Identifier: GPL-3.0-or-later
// What a verification solved, to be looked at or solved again elsewhere.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/frame.h"
#include "fibrolite/ops/material.h"
#include "fibrolite/stress.h"
#include "fibrolite/tet_mesh.h"

namespace fibrolite {

/// The whole body, taken as solid, under every load case.
struct StressField {
  TetMesh mesh;           ///< mm
  std::vector<int> part;  ///< Of each tetrahedron.
  Material material;
  struct Fixed {
    std::uint32_t node = 0;
    int axis = 0;  ///< 0, 1 or 2 of the axes of the case's `held_in`.
  };
  struct Case {
    std::string name;
    Frame held_in{};                       ///< Whose axes supports hold, in the coordinates of the field.
    std::vector<Fixed> fixed;              ///< Displacements held at zero.
    std::vector<Vec3d> force_n;            ///< Per node.
    std::vector<Vec3d> displacement_mm;    ///< Per node.
    std::vector<StressTensor> stress_mpa;  ///< Per node: that of the tetrahedra around it, weighted by volume.
  };
  std::vector<Case> cases;
  Frame frame{};  ///< Whose coordinates and axes all this is given in.
};

/// For ParaView: part of each tetrahedron; displacement, stress, von Mises and principal stresses of each load case at
/// the nodes, in world coordinates. @throws Error Io, Cancelled.
void write_vtu(const std::filesystem::path& path, const StressField& field, const Context& context = {});

/// A CalculiX (Abaqus) deck: ten-node tetrahedra, one step per load case, in the field's own frame; asks for the
/// displacements of all nodes and the stresses at the integration points, as text. N, mm, MPa. @throws Error Io,
/// Cancelled, Unsupported: a support slides askew to the field's axes.
void write_inp(const std::filesystem::path& path, const StressField& field, const Context& context = {});

}  // namespace fibrolite
