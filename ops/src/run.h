// SPDX-License-Identifier: GPL-3.0-or-later
// The small verbs of hybridize(): timed stages, the choice of an infill per part, composition, and what goes into the
// report.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fibrolite/ops/assemble.h"
#include "fibrolite/ops/dangling.h"
#include "fibrolite/ops/fill.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/measure.h"
#include "fibrolite/ops/mend.h"
#include "fibrolite/ops/solid_stream.h"
#include "fibrolite/ops/tie.h"

namespace fibrolite {

/// Runs stages one after the other: each is timed into the report and moves the progress to `until`.
class Run {
 public:
  Run(Report& report, const Context& context) : watch_(report.stages), context_(context) {}
  template <class Work>
  auto operator()(const char* name, double until, Work&& work) {
    const Context mine = part(name, until);
    return watch_(name, [&] { return work(mine); });
  }
  /// For what times its own stages.
  Context part(const char* name, double until) {
    Context mine = context_.part(from_, until, name);
    from_ = until;
    context_.check();
    return mine;
  }

 private:
  Stopwatch watch_;
  Context context_;
  double from_ = 0;
};

/// What a part gets in a run: in a hybrid by its kind, unless the user says otherwise.
[[nodiscard]] PartInfill infill_of(const Part& part, InfillKind run);
/// How much thicker the crystal is where (TcsParams::grade); none if it is not graded. `stress_mpa`: of a hybrid.
[[nodiscard]] std::optional<Shape> grading(const Box3d& box, const Shape& body, const Recipe& recipe,
                                           const std::function<double(Vec3d)>& stress_mpa, const Context& context);
/// Sizes with which the graded crystal has the recipe's density in the mean over the lumens it fills; the recipe's own
/// if it gives no density. A density out of reach goes into the report. `model`: closed, of the body.
[[nodiscard]] TcsParams at_density(const Recipe& recipe, const Shape& thickness, const Parts& parts, InfillKind run,
                                   const Mesh& model, const Shape& body, double voxel_mm, Report& report,
                                   const Context& context);
[[nodiscard]] Fill fill(const Part& part, InfillKind run, const Recipe& recipe, const Shape& body,
                        const std::optional<Shape>& thickness);

/// Edge of a section's pixel, mm: min(wall / 4, 0.1), whatever the voxel.
[[nodiscard]] double section_pixel(const Recipe& recipe);
[[nodiscard]] std::vector<Joint> join_all(const Parts& parts, const std::vector<Interface>& interfaces,
                                          const std::vector<Fill>& fills, const Recipe& recipe, const Shape& body,
                                          const Context& context);
/// Of the fills that are made of sticks.
[[nodiscard]] std::vector<Sticks> sticks_of(const Parts& parts, const std::vector<Fill>& fills);
/// Ties as thick as the thinnest member of the recipe, at least two voxels; nothing may hang on the shell by less.
/// `body`: its distance.
[[nodiscard]] TieParams tie_params(const Recipe& recipe, InfillKind infill, const Shape& body, double voxel_mm);
/// All that makes a printed solid of a body.
struct Design {
  InfillKind infill = InfillKind::Hybrid;
  Recipe recipe;
  AssembleParams assembly;
  Parts parts;
  std::vector<Fill> fills;
  std::vector<Interface> interfaces;
  std::vector<Joint> joints;
  std::vector<double> demand_n;  ///< Of each interface.
};
/// The first pass over a solid that is never whole (solid_stream.h). `kept`: may be none.
[[nodiscard]] SolidStream stream(const Mesh& model, Design design, const SlabPlan& plan, Grid grid,
                                 std::shared_ptr<KeptWork> kept, Report& report, const Context& context);

[[nodiscard]] Shape compose(const Shape& body, const Parts& parts, const std::vector<Fill>& fills,
                            const std::vector<Joint>& joints, InfillKind infill, const Recipe& recipe,
                            const AssembleParams& params);
/// The printed solid as a function: the composed shape with its ties and mends, put right wherever a sample of the
/// solid says otherwise (specks that went, pores that were filled).
/// `origins`: blocks where that may be.
[[nodiscard]] Shape as_function(const Shape& whole, const Solid& body, const Mended& made,
                                const std::vector<Vec3i>& origins, const Context& context);
/// How far a steep face may reach to be the underside of a node.
[[nodiscard]] double node_mm(const std::vector<Fill>& fills, const PrintParams& limits);
/// Where gaps and steep faces matter to a printer.
[[nodiscard]] Shape printed_lumen(const Shape& body, double shell_mm);
/// What --fix does about overhangs before there is a solid: stretches a crystal whose bonds lean more than is printed
/// without support, if that makes them steeper. Whether it did.
[[nodiscard]] bool stretch_to_print(Recipe& recipe, InfillKind infill);
/// The print checks, with what the recipe or `fix` asks for mended before them; into the report.
[[nodiscard]] Mended checked_and_mended(const Tied& tied, const Solid& body, const Parts& parts,
                                        const std::vector<Fill>& fills, const std::vector<Sticks>& sticks,
                                        const TieParams& ties, const Recipe& recipe, bool fix, Report& report,
                                        const Context& context);
/// Every step as a grid of its own (see Hybrid::steps).
[[nodiscard]] std::vector<NamedSolid> steps(const Solid& body, const Solid& raw, const Hybrid& made,
                                            const std::vector<Fill>& fills, const Mended& mended,
                                            const AssembleParams& params);

void report_decisions(const Partition& partition, const Verification& verification, Report& report);
void report_parts(const Parts& parts, const std::vector<Fill>& fills, const std::vector<PartVolumes>& volumes,
                  InfillKind infill, Report& report);
/// `demand_n`: one per interface.
void report_joints(const std::vector<Interface>& interfaces, const std::vector<Joint>& joints,
                   const std::vector<double>& demand_n, const Recipe& recipe, Report& report);
/// A warning if the model is hardly more than a few voxels.
void report_coarse(const Box3d& model, double voxel_mm, Report& report);
/// Down to which thickness necks are looked for, and a warning if that is thinner than a wall may be.
void report_necks(double thinnest_mm, Grid grid, const PrintParams& limits, Report& report);
/// All but the samples' number and size.
void report_solid(const Tied& tied, const std::vector<Fill>& fills, const Volumes& volumes, const Material& material,
                  Report& report);

}  // namespace fibrolite
