// SPDX-License-Identifier: GPL-3.0-or-later
// The body in pieces: sections cut its links, what stays connected is a piece.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "limb.h"
#include "segment.h"

namespace fibrolite {

/// What every step of the partition reads.
struct Anatomy {
  const Mesh* surface = nullptr;
  const DiameterField* field = nullptr;
  FaceGraph graph;
  VoxelBody body;
  std::vector<std::int32_t> nearest;         ///< Per lattice sample: nearest inside sample.
  std::vector<std::int32_t> face_of_sample;  ///< Per inside sample: nearest face.
  std::vector<std::int32_t> sample_of_face;
  Vec3d centre{};         ///< Of the body.
  double volume_mm3 = 0;  ///< Of the proxy.
  Frame frame;            ///< Of the proxy, for places told to the user.
};
[[nodiscard]] Anatomy make_anatomy(const Proxy& proxy, const DiameterField& field, const Context& context);

struct CutPieces {
  std::vector<Section> cuts;              ///< Those that separate.
  std::vector<std::array<int, 2>> sides;  ///< Piece on the near and on the far side of each.
  std::vector<Severed> severed;           ///< Samples next to each.
  std::vector<std::uint8_t> shared;       ///< 1: other pairs of pieces meet in the same section, as another cut.
  Links links;
  std::vector<std::int32_t> of;  ///< Piece per inside sample.
  int count = 0;

  [[nodiscard]] LimbPiece piece(const Anatomy& anatomy, int id) const;
};
/// Cuts that do not separate are dropped; crumbs (below `min_area` of the surface) go to the piece they hang on.
[[nodiscard]] CutPieces cut_body(const Anatomy& anatomy, std::vector<Section> cuts, double min_area);

/// Cuts that cross others part more than one pair of pieces: one cut for each pair that shares more than a few links.
void part_by_pairs(const Anatomy& anatomy, CutPieces& pieces);

/// A limb wider than this many times its thickness is a sheet, and fibres along it would bear nothing across.
inline constexpr double flattest_limb = 2.5;

struct Limbs {
  CutPieces pieces;
  std::vector<std::uint8_t> limb;  ///< Per piece.
  int count = 0;
  std::vector<std::string> notes;
};
/// Thin regions at a threshold that a plane cuts off cleanly and that are longer than wide and not flat.
[[nodiscard]] Limbs find_limbs(const Anatomy& anatomy, double threshold, double min_area, double min_slenderness);

}  // namespace fibrolite
