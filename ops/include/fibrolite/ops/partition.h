// SPDX-License-Identifier: GPL-3.0-or-later
// Partition by diameter (paper Sec. 4.1): candidates as functions of space, the same at every voxel size.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/ops/bent_plane.h"
#include "fibrolite/ops/diameter.h"
#include "fibrolite/ops/overrides.h"
#include "fibrolite/shape.h"

namespace fibrolite {

/// A cut between two candidates: a disc in the xy plane of `frame`, whose z axis points from `a` into `b`; or what lies
/// over that disc of a bent plane.
struct Cut {
  int a = 0, b = 0;
  Frame frame;
  double radius_mm = 0;  ///< Of the disc about frame.origin that covers the section.
  bool kept = false;     ///< The user's own: stays, even between two bulk parts.
  bool shared = false;   ///< Other pairs meet in the same section: it counts only where a lies beside b.
  Bend bend{};
  [[nodiscard]] BentPlane surface() const { return {frame, bend}; }
};

/// A straight core cut out of a candidate: a cylinder about the z axis of `frame`, from its origin. Its ends lie beyond
/// the body's surface.
struct Core {
  int id = 0, host = 0;  ///< Its own candidate, and the one it is cut out of.
  Frame frame;
  double radius_mm = 0, length_mm = 0;
};

/// The axis of a limb: a unit field and a centre line, from its interface (or one end) to its tip.
class Axis {
 public:
  struct Impl;
  Axis();  ///< A straight axis along z.
  explicit Axis(std::shared_ptr<const Impl> impl);
  /// A straight axis.
  static Axis straight(Vec3d from, Vec3d to);
  /// A centre line through `points` (at least two); the field is its tangent at the nearest point.
  static Axis along(const std::vector<Vec3d>& points);
  /// Unit tangent t(x). Cost: O(points of the line).
  [[nodiscard]] Vec3d tangent(Vec3d p) const;
  /// Smooth, evenly spaced, turning so gently that normal planes do not cross inside the limb.
  [[nodiscard]] const std::vector<Vec3d>& centre_line() const;
  [[nodiscard]] double length_mm() const;
  /// Mean direction, unit.
  [[nodiscard]] Vec3d mean() const;

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Which candidate owns a point. Immutable, thread-safe, cheap to copy.
class Labels {
 public:
  struct Impl;
  Labels();  ///< One candidate, 0, owns everything.
  explicit Labels(std::shared_ptr<const Impl> impl);
  [[nodiscard]] int count() const;
  /// In [0, count). Every point of space has exactly one owner. Cost: O(cuts nearby).
  [[nodiscard]] int label(Vec3d p) const;
  /// p_i: negative inside part i, the exact plane distance near a cut, clamped far from one.
  [[nodiscard]] Shape region(int i) const;
  /// The same points, candidates renamed by `part_of_candidate` (several may get one name; borders between them
  /// vanish).
  [[nodiscard]] Labels merged(const std::vector<int>& part_of_candidate) const;
  /// The same labels, less what each core takes from its host. Ids of cores go on where the labels end, in order.
  [[nodiscard]] Labels carved(const std::vector<Core>& cores) const;
  /// These are labels of a frame's coordinates: the same in the world's.
  [[nodiscard]] Labels placed(const Frame& frame) const;

 private:
  std::shared_ptr<const Impl> impl_;
};

struct Candidate {
  int id = 0;
  bool column_like = false;  ///< Below the threshold and longer than wide; else bulk.
  double volume_mm3 = 0;     ///< On the proxy.
  Vec3d centroid_mm{};
  double diameter_mm = 0;  ///< Median diameter of its faces.
  double length_mm = 0;    ///< Along the axis.
  Axis axis;
  std::string reason;                  ///< Why column-like or not, in words with numbers.
  std::optional<PartInfill> chosen{};  ///< The user's own choice; such a candidate stays a part of its own.
};

/// What parts are found by.
enum class PartBy {
  Shape,  ///< The paper's: columns stand out by their diameter.
  Load,   ///< Cores where the load runs (find_cores()), out of one piece.
  Both,   ///< Shape, then cores in what is bulky.
};
struct PartitionParams {
  PartBy by = PartBy::Shape;
  std::optional<double>
      threshold;                 ///< nsdf below this is column-like, 0 to 1; absent: auto, the most stable partition.
  double min_area = 0.012;       ///< Regions below this share of the surface join a neighbour; 0 to 0.5.
  double min_slenderness = 1.0;  ///< A limb, or a core, shorter than this many diameters is no column.
  /// A core starts where the stress along one direction is this many times the body's mean; 0 to 100.
  double concentration = 1.5;
  /// Section of a core, over one that would carry all of the load at the core's largest stress; above 0, up to 2. More
  /// carries more along the core, and leaves less for what the rest has to carry.
  double core_share = 0.7;
  Overrides overrides{};  ///< Its cuts take the place of the threshold.
};
struct Partition {
  std::vector<Candidate> candidates;  ///< Sorted by id; at least one.
  std::vector<Cut> cuts;
  std::vector<Core> cores;  ///< Their candidates are the last ones.
  Labels labels;
  double threshold = 0;                   ///< The one used.
  double stable_from = 0, stable_to = 0;  ///< Range of thresholds that give the same partition (auto only).
  std::vector<std::string> notes;
};
/// @throws Error BadRecipe (a range above; a cut of the user's that meets no section).
/// Cost: a few seconds for 15 k faces. Source: paper Sec. 4.1; choice of threshold ours.
[[nodiscard]] Partition partition(const Proxy& proxy, const DiameterField& field, const PartitionParams& params = {},
                                  const Context& context = {});

/// Gives each candidate that the overrides name its infill. @throws Error BadRecipe: there is no such candidate.
void choose_infills(Partition& partition, const Overrides& overrides);

}  // namespace fibrolite
