// SPDX-License-Identifier: GPL-3.0-or-later
// Load cases as a user states them: where a body is held and what acts on it. Lengths in mm, world frame, after
// scaling.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fibrolite/box.h"
#include "fibrolite/frame.h"
#include "fibrolite/mesh.h"
#include "fibrolite/shape.h"
#include "fibrolite/vec.h"

namespace fibrolite {

/// A direction: a vector of the world, or a word about how the model stands. `Slanted` goes down at 45 degrees and
/// comes from the azimuth of the verification, as in the paper (Sec. 4.2).
struct Direction {
  enum class Of { World, Up, Down, Slanted };
  Of of = Of::World;
  Vec3d vector{};  ///< Of World alone: any length above zero.
};

/// All p with dot(p - point_mm, normal) <= 0: the normal points out of what is selected.
struct HalfSpace {
  Vec3d point_mm{};
  Vec3d normal{};  ///< Any length above zero.
};
/// One end of the body: a share of its extent along a direction.
struct EndShare {
  double share = 0.05;  ///< Above 0, up to 1.
  Direction along{Direction::Of::Up, {}};
};
/// Triangles of one colour in the file of the model.
struct Paint {
  Rgb color;
  Shape distance{};  ///< To them, mm, never negative. Far away until with_paint() has found them.
};
/// A piece of the body's surface: what all of the selectors given agree on; at least one.
struct Selection {
  std::optional<Box3d> box_mm{};
  std::vector<HalfSpace> half_spaces{};
  std::optional<EndShare> lowest{}, highest{};
  /// A candidate of the partition, numbered from 0 as partition() does: before touching bulk candidates become one
  /// part.
  std::optional<int> label{};
  std::optional<Paint> painted{};
  /// Only what is seen first by an eye that looks from there (the direction points from the body to the eye), and lies
  /// in no support of the case. A force on it is spread by projected area. Not for supports.
  std::optional<Direction> seen_from{};
};

/// What is held. All of the body that lies in it, not its surface alone, as a clamp or a foot in a bed.
struct Support {
  Selection where{};
  /// Absent: held fast. Present: held along this alone, free to slide across it.
  std::optional<Direction> sliding{};
};

/// A force of so many newton in all, spread evenly by area (by projected area if seen_from is given).
struct TotalForce {
  double newton = 0;  ///< Above 0.
  Direction direction{Direction::Of::Down, {}};
  Selection where{};
};
/// Acts against the outward normal; negative: suction. seen_from does not go with it.
struct Pressure {
  double mpa = 0;  ///< Not 0.
  Selection where{};
};
/// The weight of the body, taken as solid, at 9.80665 m/s2.
struct Gravity {
  Direction direction{Direction::Of::Down, {}};
};
using Force = std::variant<TotalForce, Pressure, Gravity>;

struct LoadCase {
  std::string name;  ///< Not empty, and no other case's.
  std::vector<Support> supports;
  std::vector<Force> forces;  ///< They act together.
  /// Parts are decided without it; only the strength of the finished solid is measured under it, too.
  bool unplanned = false;
};

/// What a selection found on a body.
struct Selected {
  std::string key;  ///< E.g. "loads[1].supports[0].where".
  std::string load_case;
  double area_mm2 = 0;     ///< Of the surface; projected if seen_from is given.
  std::int64_t faces = 0;  ///< Triangles of the finite element mesh that it touches.
};

/// "paper-verify", "paper-compare", "stand".
[[nodiscard]] std::vector<std::string> load_preset_names();
/// paper-compare: 110 N straight down on what is seen from above (paper Sec. 7, Fig. 12); stand: own weight. Both stand
/// on the lowest 5 %. paper-verify is empty: the two cases of the verification with its own numbers (VerifyParams), by
/// default 1000 N from above and the same at 45 degrees (paper Sec. 4.2).
/// @throws Error BadRecipe: no such preset (with the nearest name).
[[nodiscard]] std::vector<LoadCase> load_preset(std::string_view name);

/// What can be wrong with load cases before there is a body: no support, no force, no selector, a number out of range,
/// a name given twice. @throws Error BadRecipe, naming the case and the key.
void check_loads(const std::vector<LoadCase>& cases);

/// The same cases with each colour found in `colored`, the model as it was read (Model::painted).
/// @throws Error BadRecipe: a colour that no triangle has, with those there are. Cost: O(n log n) per colour.
[[nodiscard]] std::vector<LoadCase> with_paint(std::vector<LoadCase> cases, const Mesh& colored);

/// "#ff8000"
[[nodiscard]] std::string color_text(Rgb color);

/// The same cases in a frame's coordinates. A box becomes six half-spaces, so it stays what it is however the frame
/// lies; words for directions stay words. Cost: O(selectors).
[[nodiscard]] std::vector<LoadCase> in_frame(const Frame& frame, std::vector<LoadCase> cases);

}  // namespace fibrolite
