// SPDX-License-Identifier: GPL-3.0-or-later
// A verified part of the model. Only verify() makes one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fibrolite/ops/partition.h"
#include "fibrolite/shape.h"

namespace fibrolite {

enum class Kind { Column, Bulk };
[[nodiscard]] constexpr const char* name(Kind kind) { return kind == Kind::Column ? "column" : "bulk"; }

/// How a part carries one load case, MPa; of merged pieces: the largest.
struct CaseStress {
  std::string load_case;
  double axial = 0, transverse[2] = {0, 0}, von_mises = 0;  ///< Means, as in PartStress.
  double dominance = 0;
  double p99_von_mises = 0;         ///< 99 % of the volume is at or below it.
  double strain_energy_nmm = 0;     ///< From the mean stress of each tetrahedron.
  double principal[3] = {0, 0, 0};  ///< Of the mean stress, largest magnitude first.
  Vec3d principal_direction{};      ///< Of the first of them, unit.
};

/// Mean stress of a part in its own axis field, of the load case that decided (the one with the smallest dominance),
/// MPa. Of merged pieces: of the largest.
struct PartStress {
  double axial = 0;
  double transverse[2] = {0, 0};
  double von_mises = 0;
  double dominance = 0;  ///< axial / transverse[0], the smallest over the load cases that load it; 0 if unloaded.
  std::vector<CaseStress> cases{};  ///< All of them.
};

class Part {
 public:
  [[nodiscard]] int id() const { return id_; }
  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] const std::vector<int>& candidates() const { return candidates_; }  ///< Largest first.
  [[nodiscard]] std::optional<PartInfill> chosen() const { return chosen_; }        ///< The user's infill, if any.
  [[nodiscard]] const Shape& region() const { return region_; }                     ///< p_i of Labels::region().
  [[nodiscard]] const Box3d& bounds_mm() const { return bounds_; }
  [[nodiscard]] const Axis& axis() const { return axis_; }
  [[nodiscard]] double diameter_mm() const { return diameter_; }
  [[nodiscard]] double volume_mm3() const { return volume_; }  ///< On the proxy.
  [[nodiscard]] Vec3d centroid_mm() const { return centroid_; }
  [[nodiscard]] const PartStress& stress() const { return stress_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  friend class PartMaker;  // ops/src/part_maker.h, for this library alone
  Part() = default;
  int id_ = 0;
  Kind kind_ = Kind::Bulk;
  std::vector<int> candidates_;
  std::optional<PartInfill> chosen_;
  Shape region_;
  Box3d bounds_;
  Axis axis_;
  double diameter_ = 0, volume_ = 0;
  Vec3d centroid_{};
  PartStress stress_;
  std::string reason_;
};

/// Every point of the body belongs to exactly one part; parts[i].id() == i.
struct Parts {
  std::vector<Part> parts;
  Labels labels;              ///< By part id.
  std::vector<Cut> cuts;      ///< Between different parts, by part id.
  std::vector<Core> cores{};  ///< Those that are columns; id and host by part id.
};

}  // namespace fibrolite
