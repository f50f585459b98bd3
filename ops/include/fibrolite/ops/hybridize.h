// SPDX-License-Identifier: GPL-3.0-or-later
// The whole method on one screen.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/mesh.h"
#include "fibrolite/ops/infill/infill.h"
#include "fibrolite/ops/interfaces.h"
#include "fibrolite/ops/joint.h"
#include "fibrolite/ops/part.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/recipe.h"
#include "fibrolite/ops/report.h"
#include "fibrolite/ops/solid_stream.h"
#include "fibrolite/solid.h"
#include "fibrolite/solid_io.h"

namespace fibrolite {

class KeptWork;  // kept_work.h

struct HybridizeParams {
  Recipe recipe;
  InfillKind infill = InfillKind::Hybrid;
  std::optional<double> voxel_mm;  ///< Default: choose_voxel().
  bool fix = false;                ///< Mend what the print checks find (mend.h).
  bool steps = false;              ///< Also realize every step as a grid of its own.
  bool function = false;           ///< Also give the solid as a distance function (Hybrid::printed).
  /// Which the process may take while a mesh that overlaps itself is mended (repair_bytes()).
  double most_bytes = std::numeric_limits<double>::infinity();
  /// Make no solid but one that comes slab by slab (Hybrid::stream). No mending, steps nor function.
  std::optional<SlabPlan> slabs{};
  /// Where a solid in slabs keeps what it has found out, and looks for it. Its work must name model and params; the
  /// slabs may be others.
  std::shared_ptr<KeptWork> kept{};
};
struct Hybrid {
  Solid solid;  ///< The printed solid. Values inside may be told deeper than the band: narrowed() before to_vdb().
  Parts parts;
  Labels candidates;  ///< Of the partition, before touching bulk became one part; of other infills: one.
  std::vector<Interface> interfaces;
  std::vector<Joint> joints;
  /// If asked for: body, shell, fill_<part>, joint_<n>, removed (stick ends), ties, thickened, drains (holes), specks
  /// (removed), pores (filled), solid. The union of shell, fills and joints, less what is removed, with ties, thickened
  /// and pores, less drains and specks, is the solid.
  std::vector<NamedSolid> steps;
  Shape body;  ///< Distance to the model, as far in as the shell goes.
  /// If asked for: the solid as a function, sharper than its voxels: body, shell, fills, joints and ties as composed,
  /// less the specks, with the pores filled. It holds the body's distance and no grid of the solid.
  Shape printed;
  std::optional<SolidStream> stream{};  ///< If slabs were asked for: what makes the solid, which is empty.
  StressField field;                    ///< If recipe.verify.keep_field, of a hybrid.
};
/// The candidates by recipe.partition.by: limbs by shape, cores by load, or both. `load`: as the proxy stands
/// (in_stance()). Its stages are timed into `stages`. @throws Error of partition() and find_cores().
[[nodiscard]] Partition find_candidates(const Proxy& proxy, const Recipe& recipe, const VerifyParams& load,
                                        std::vector<StageReport>& stages, const Context& context = {});
/// Model -> printed solid. Fills in everything of `report` but the mesh block.
/// @throws Error of every stage. Cost: see docs/performance.md.
[[nodiscard]] Hybrid hybridize(const Model& model, const HybridizeParams& params, Report& report,
                               const Context& context = {});

/// The voxel a run will use, mm: the wanted one, or the smallest of a 400th of the longest side, a third of the
/// thinnest feature and, down to a quarter of it, what necks of print.wall_mm are told at.
[[nodiscard]] double choose_voxel(const Box3d& model, const Recipe& recipe, InfillKind infill,
                                  std::optional<double> wanted);
/// What a run does besides.
struct Extras {
  bool open = false;      ///< The mesh is open (repair_bytes()): its outermost surface is found, all of it at once.
  bool mends = false;     ///< Faults or drain holes.
  bool pictures = false;  ///< The mesh is kept whole for them.
  bool steps = false;     ///< Every step's solid is kept.
};
/// What a run may take at its highest, from area, volume, voxel and recipe: above all that was measured. Cost: O(n).
[[nodiscard]] double most_memory(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill,
                                 const Extras& extras = {});
/// What a run will come to, from points of the structure: voxels and triangles within 15 %, memory within 25 %, time
/// within 40 % where it was measured; of a hybrid, whose parts are not yet known, within 30 % and more.
struct Prediction {
  double memory_bytes = 0;         ///< At its highest, of a whole run with a mesh.
  double sliced_memory_bytes = 0;  ///< Of one that is sliced, without its pixels.
  double active_voxels = 0, triangles = 0;
  double faces_mm2 = 0;  ///< Surface of the structure.
  double cpu_s = 0;      ///< Until the mesh is checked; times machine_times().
  double solid_s = 0;    ///< Of that, until there is a solid.
  double slabs_s = 0;    ///< What slabs add to that.
};
/// Cost: a tree of the model and some tenths of a second.
[[nodiscard]] Prediction predict(const Mesh& model, double voxel_mm, const Recipe& recipe, InfillKind infill,
                                 const Extras& extras = {});
/// How many times as long this machine takes as the one Prediction::cpu_s was fitted on, for the crystal at some
/// points. Cost: a few milliseconds.
[[nodiscard]] double machine_times();

}  // namespace fibrolite
