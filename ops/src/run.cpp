// SPDX-License-Identifier: GPL-3.0-or-later
#include "run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "fibrolite/blocks.h"
#include "fibrolite/ops/grading.h"
#include "fibrolite/ops/sleeve.h"
#include "fibrolite/ops/text.h"
#include "fibrolite/ops/trim.h"
#include "fibrolite/realize.h"
#include "fibrolite/to_solid.h"

namespace fibrolite {

Partition find_candidates(const Proxy& proxy, const Recipe& recipe, const VerifyParams& load,
                          std::vector<StageReport>& stages, const Context& context) {
  Stopwatch stage(stages);
  const PartBy by = recipe.partition.by;
  Partition parts;
  if (by == PartBy::Load) {
    parts = undivided(proxy);
  } else {
    const DiameterField field =
        stage("diameter", [&] { return diameter(proxy.surface, {}, context.part(0, 0.4, "diameter")); });
    parts = stage("partition",
                  [&] { return partition(proxy, field, recipe.partition, context.part(0.4, 0.6, "partition")); });
  }
  if (by != PartBy::Shape) {
    parts = stage("cores", [&] {
      return find_cores(proxy, std::move(parts), core_params(recipe), load, recipe.material,
                        context.part(0.6, 1, "cores"));
    });
  }
  choose_infills(parts, recipe.partition.overrides);
  return parts;
}

PartInfill infill_of(const Part& part, InfillKind run) {
  switch (run) {
    case InfillKind::Hybrid:
      return part.chosen().value_or(part.kind() == Kind::Column ? PartInfill::Mfs : PartInfill::Tcs);
    case InfillKind::Tcs:
      return PartInfill::Tcs;
    case InfillKind::Mfs:
      return PartInfill::Mfs;
    case InfillKind::Solid:
      break;
    case InfillKind::Gyroid:
      return PartInfill::Gyroid;
    case InfillKind::Shell:
      return PartInfill::Shell;
  }
  return PartInfill::Solid;
}

std::optional<Shape> grading(const Box3d& box, const Shape& body, const Recipe& recipe,
                             const std::function<double(Vec3d)>& stress_mpa, const Context& context) {
  const TcsParams& tcs = recipe.tcs;
  if (tcs.grade == TcsGrade::None) return std::nullopt;
  const double depth = tcs.grade_depth_mm, shell_mm = recipe.shell.thickness_mm;
  if (tcs.grade == TcsGrade::Stress) {
    const StressGrade grade{.least = tcs.grade_least, .most = tcs.grade_most, .slope_mm = depth};
    return thicker_where_stressed(grade, box, body, stress_mpa, context);
  }
  return thicker_at_surface(tcs, depth_table(body, box, depth / 4, context), shell_mm);
}

TcsParams at_density(const Recipe& recipe, const Shape& thickness, const Parts& parts, InfillKind run,
                     const Mesh& model, const Shape& body, double voxel_mm, Report& report, const Context& context) {
  if (!recipe.tcs.density) return recipe.tcs;
  std::vector<Shape> crystals;
  for (const Part& part : parts.parts)
    if (infill_of(part, run) == PartInfill::Tcs) crystals.push_back(part.region());
  if (crystals.empty()) return recipe.tcs;
  const std::vector<Vec3d> places = places_inside(body, bounds(model), signed_volume(model), recipe.shell.thickness_mm,
                                                  unite(std::move(crystals)), context);
  std::vector<float> factors(places.size(), 1.0F);
  thickness.evaluate(places, factors);
  if (factors.empty()) factors.push_back(1);  // no lumen, no crystal: any size will do
  const GradedSizes found = sized(recipe.tcs, factors, 2 * voxel_mm);
  const double wanted = *recipe.tcs.density;
  if (std::abs(found.density / wanted - 1) > 0.01) {
    const MemberRange range = members(found.params);
    report.warnings.push_back(std::string("tcs.density: ")
                                  .append(number_text(wanted))
                                  .append(" was asked for, ")
                                  .append(number_text(std::round(1e4 * found.density) / 1e4))
                                  .append(found.density > wanted ? " is the least that members of two voxels, "
                                                                 : " is the most that members the cell has room for, ")
                                  .append(number_text(std::round(1e3 * range.least_mm) / 1e3))
                                  .append(" to ")
                                  .append(number_text(std::round(1e3 * range.most_mm) / 1e3))
                                  .append(" mm, give with this grading"));
  }
  return found.params;
}

Fill fill(const Part& part, InfillKind run, const Recipe& recipe, const Shape& body,
          const std::optional<Shape>& thickness) {
  switch (infill_of(part, run)) {
    case PartInfill::Tcs: {
      TcsParams tcs = recipe.tcs;
      tcs.up = recipe.verify.up;
      return thickness ? generate(part, tcs, *thickness) : generate(part, tcs);
    }
    case PartInfill::Mfs:
      return generate(part, recipe.mfs, body, recipe.shell.thickness_mm);
    case PartInfill::Gyroid:
      return generate(part, recipe.gyroid);
    case PartInfill::Shell:
      return {.shape = nothing()};
    case PartInfill::Solid:
      break;
  }
  return {.shape = everything()};
}

double section_pixel(const Recipe& recipe) { return std::min(0.25 * recipe.mfs.wall_mm, 0.1); }

std::vector<Sticks> sticks_of(const Parts& parts, const std::vector<Fill>& fills) {
  std::vector<Sticks> sticks;
  for (std::size_t i = 0; i < fills.size(); ++i) {
    const Part& part = parts.parts[i];
    if (fills[i].sticks) sticks.push_back({fills[i].sticks, fills[i].ball_mm, part.bounds_mm(), part.region()});
  }
  return sticks;
}

TieParams tie_params(const Recipe& recipe, InfillKind infill, const Shape& body, double voxel_mm) {
  const double thinnest = thinnest_mm(recipe, infill), strut = members(recipe.tcs).least_mm;
  TieParams params{.strut_mm = std::max(strut, 2 * voxel_mm), .reach_mm = 2 * recipe.tcs.cell_mm.most()};
  if (std::isfinite(thinnest)) {
    params.neck_mm = thinnest;
    params.strut_mm = std::max(params.strut_mm, thinnest);
    params.anchor = shell(body, recipe.shell.thickness_mm);
  }
  return params;
}

std::vector<Joint> join_all(const Parts& parts, const std::vector<Interface>& interfaces,
                            const std::vector<Fill>& fills, const Recipe& recipe, const Shape& body,
                            const Context& context) {
  std::vector<Joint> joints;
  const double member = members(recipe.tcs).least_mm;
  for (std::size_t i = 0; i < interfaces.size(); ++i) {
    const Interface& at = interfaces[i];
    const auto a = static_cast<std::size_t>(at.a), b = static_cast<std::size_t>(at.b);
    if (at.length_mm > 0) {
      const Shape both = unite({parts.parts[a].region(), parts.parts[b].region()});
      joints.push_back(sleeve(at, fills[a].shape, fills[b].shape, both, body, recipe.shell.thickness_mm,
                              recipe.mfs.wall_mm, section_pixel(recipe)));
      continue;
    }
    const auto crystal = [&](std::size_t part) {
      return infill_of(parts.parts[part], InfillKind::Hybrid) == PartInfill::Tcs;
    };
    joints.push_back(join(at, fills[a].shape, fills[b].shape, crystal(a), crystal(b), member, body,
                          recipe.shell.thickness_mm, recipe.seed, static_cast<int>(i), joint_params(recipe), context));
    context.progress(static_cast<double>(i + 1) / static_cast<double>(interfaces.size()));
  }
  return joints;
}

Shape compose(const Shape& body, const Parts& parts, const std::vector<Fill>& fills, const std::vector<Joint>& joints,
              InfillKind infill, const Recipe& recipe, const AssembleParams& params) {
  if (infill == InfillKind::Solid) return body;
  std::vector<FilledRegion> filled;
  for (std::size_t i = 0; i < fills.size(); ++i) filled.push_back({parts.parts[i].region(), fills[i].shape});
  std::vector<Shape> shapes;
  for (const Joint& joint : joints) shapes.push_back(joint.shape);
  if (!recipe.partition.overrides.solid.empty()) shapes.push_back(kept_solid(recipe.partition.overrides));
  return assemble(body, filled, shapes, params);
}

double node_mm(const std::vector<Fill>& fills, const PrintParams& limits) {
  double most = 2 * limits.wall_mm;
  for (const Fill& fill : fills) most = std::max(most, fill.ball_mm);
  return most;
}

Shape printed_lumen(const Shape& body, double shell_mm) { return offset(body, -0.5 * shell_mm); }

namespace {

/// Of the crystal as it is printed.
double leaning_deg(const Recipe& recipe) {
  TcsParams tcs = recipe.tcs;
  tcs.up = recipe.verify.up;
  return steepest_overhang_deg(tcs);
}
double steepest_deg(const PrintParams& limits) { return limits.overhang_deg + overhang_tolerance_deg; }

/// All crystal, which says by itself how steep it is (TcsParams::stretch_z).
Shape lattice(const Parts& parts, const std::vector<Fill>& fills) {
  std::vector<Shape> all;
  for (std::size_t i = 0; i < fills.size(); ++i)
    if (fills[i].fibres == 0) all.push_back(intersect({parts.parts[i].region(), fills[i].shape}));
  return unite(std::move(all));
}

/// What --fix leaves, in words.
std::vector<std::string> left_unmended(const Printable& found, const Recipe& recipe, bool any_sticks) {
  const PrintParams& limits = recipe.print;
  std::vector<std::string> texts;
  const auto places = [](const PrintFault& fault) {
    return std::to_string(fault.places) + (fault.places == 1 ? " place" : " places");
  };
  if (found.thin_walls.places > 0)
    texts.push_back("--fix leaves " + places(found.thin_walls) + " thinner than print.wall_mm, the thinnest " +
                    number_text(found.thin_walls.least_mm, 2) +
                    " mm (print.thin_walls in the report): what the model itself makes so thin stays; else use a "
                    "smaller --voxel");
  if (found.small_gaps.places > 0)
    texts.push_back("--fix leaves " + places(found.small_gaps) + " where a gap is narrower than print.gap_mm " +
                    "(print.small_gaps in the report): use a smaller --voxel");
  if (found.overhangs.area_mm2 <= 0.01 * found.lumen_mm2) return texts;
  const std::string much = number_text(100 * found.overhangs.area_mm2 / found.lumen_mm2, 2) + " % of the faces inside";
  if (const double leaning = leaning_deg(recipe); any_sticks && leaning > steepest_deg(limits)) {
    texts.push_back("the crystal's sticks lean " + number_text(leaning, 3) +
                    " degrees from upright, more than print.overhang_deg allows, which --fix leaves: make the "
                    "cell of tcs.cell_mm taller, or leave out tcs.rotate_deg");
  } else {
    texts.push_back("--fix leaves " + much +
                    " steeper than print.overhang_deg allows (print.overhangs in the report): what is curved, as a "
                    "sheet of crystal is, faces every way; sticks with tcs.stretch_z do not");
  }
  return texts;
}

}  // namespace

bool stretch_to_print(Recipe& recipe, InfillKind infill) {
  const bool sticks = recipe.tcs.form != TcsForm::Sheet && (infill == InfillKind::Tcs || infill == InfillKind::Hybrid);
  if (!sticks || recipe.tcs.stretch_z || leaning_deg(recipe) <= steepest_deg(recipe.print)) return false;
  Recipe taller = recipe;
  taller.tcs.stretch_z = true;
  if (leaning_deg(taller) >= leaning_deg(recipe)) return false;
  recipe = taller;
  return true;
}

Mended checked_and_mended(const Tied& tied, const Solid& body, const Parts& parts, const std::vector<Fill>& fills,
                          const std::vector<Sticks>& sticks, const TieParams& ties, const Recipe& recipe, bool fix,
                          Report& report, const Context& context) {
  const PrintParams& limits = recipe.print;
  const double voxel = body.grid().voxel_mm, shell_mm = recipe.shell.thickness_mm;
  const double drain_mm = limits.drain_mm.value_or(fix ? std::max(default_drain_mm, 2 * voxel) : 0);
  Mended out{.tied = tied};
  const bool mending = fix || drain_mm > 0;
  if (!mending && !limits.check) return out;
  if (mending) {
    out = mend(tied, body,
               {.print = limits,
                .faults = fix,
                .drain_mm = drain_mm,
                .up = recipe.verify.up,
                .shell_mm = shell_mm,
                .tie = ties,
                .node_mm = node_mm(fills, limits),
                .lattice = lattice(parts, fills)},
               context);
    TieParams around = ties;
    around.keep_out = out.keep_out();
    const Solid& solid = out.tied.solid;  // from here on the whole
    Tied rest{.solid = solid, .left = out.tied.left, .unreached = out.tied.unreached};
    rest = trim(std::move(rest), distance_to(solid), body, sticks, shell_mm, around, context);
    out.tied.dangling = 0;  // counted again
    out.tied = and_then(out.tied, std::move(rest));
  }
  const Shape lumen = printed_lumen(distance_to(body), shell_mm);
  report.print.found = printable(out.tied.solid, lumen, limits, recipe.verify.up, node_mm(fills, limits), context);
  report.print.checked = true;
  const Printable& found = report.print.found;
  if (fix) {
    for (std::string& text : left_unmended(found, recipe, !sticks.empty())) report.warnings.push_back(std::move(text));
  }
  report.print.drains = out.drains;
  report.print.thickened = static_cast<std::int64_t>(out.thickened.size());
  report.print.pillars = static_cast<std::int64_t>(out.pillars.size());
  report.print.voids_filled = out.voids_filled;
  return out;
}

namespace {

/// With pores filled and specks taken away: both balls of one radius, that count no farther than that from their
/// surface, so that the value at a point does not depend on balls elsewhere.
struct Retouched final : Shape::Function {
  using Values = std::array<float, PointBlock::capacity>;
  Retouched(Shape m, Shape b, Shape p, Shape s, float r)
      : made(std::move(m)), body(std::move(b)), pores(std::move(p)), specks(std::move(s)), radius(r) {}

  void evaluate(const PointBlock& block, float* out) const override {
    made.evaluate(block, out);
    Box3d box;
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t k = 0; k < count; ++k) box.include(Vec3d{block.x[k], block.y[k], block.z[k]});
    Values ball, b;
    if (pores.bound(box).lo < radius) {
      pores.evaluate(block, ball.data());
      body.evaluate(block, b.data());
      for (std::size_t k = 0; k < count; ++k)
        if (ball[k] < radius) out[k] = std::min(out[k], std::max(b[k], ball[k]));
    }
    if (specks.bound(box).lo < radius) {
      specks.evaluate(block, ball.data());
      for (std::size_t k = 0; k < count; ++k)
        if (ball[k] < radius) out[k] = std::max(out[k], -ball[k]);
    }
  }
  [[nodiscard]] Interval bound(const Box3d& box) const override {
    const Interval m = made.bound(box), p = pores.bound(box), s = specks.bound(box);
    return {p.lo < radius ? std::min(m.lo, p.lo) : m.lo, s.lo < radius ? std::max(m.hi, -s.lo) : m.hi};
  }
  [[nodiscard]] double lipschitz() const override { return made.lipschitz(); }

  Shape made, body, pores, specks;
  float radius;
};

}  // namespace

Shape as_function(const Shape& whole, const Solid& body, const Mended& mended, const std::vector<Vec3i>& origins,
                  const Context& context) {
  const Shape b = distance_to(body), solid = distance_to(mended.tied.solid);
  Shape made = with_mends(whole, b, mended);

  // Samples on which function and solid differ: a ball about each, which covers the cells around it.
  struct Differing {
    std::vector<Capsule> specks, pores;
  };
  const double voxel = body.grid().voxel_mm, radius = 0.5 * std::numbers::sqrt3 * voxel;
  const auto rounding = static_cast<float>(1e-3 * voxel);
  std::vector<Differing> differing(origins.size());
  for_each_block(origins, voxel, [&](std::size_t number, const PointBlock& block) {
    context.check();
    std::array<float, PointBlock::capacity> f, s;
    made.evaluate(block, f.data());
    solid.evaluate(block, s.data());
    for (std::size_t k = 0; k < f.size(); ++k) {
      if ((f[k] < 0) == (s[k] < 0) || std::abs(f[k]) < rounding) continue;
      const Vec3d at{block.x[k], block.y[k], block.z[k]};
      (s[k] < 0 ? differing[number].pores : differing[number].specks).push_back({at, at, radius});
    }
  });
  Differing all;
  for (const Differing& one : differing) {
    all.specks.insert(all.specks.end(), one.specks.begin(), one.specks.end());
    all.pores.insert(all.pores.end(), one.pores.begin(), one.pores.end());
  }
  if (all.pores.empty() && all.specks.empty()) return made;
  return Shape(std::make_shared<const Retouched>(made, b, capsules(all.pores), capsules(all.specks),
                                                 static_cast<float>(radius)));
}

std::vector<NamedSolid> steps(const Solid& body, const Solid& raw, const Hybrid& made, const std::vector<Fill>& fills,
                              const Mended& mended, const AssembleParams& params) {
  const Shape b = distance_to(body);
  std::vector<NamedSolid> result;
  const auto add = [&](const std::string& name, const Shape& shape) {
    result.push_back({name, realize(intersect({b, shape}), body)});
  };
  add("body", b);
  add("shell", shell(b, params.shell_mm));
  for (std::size_t i = 0; i < fills.size(); ++i) {
    add("fill_" + std::to_string(i), clip({made.parts.parts[i].region(), fills[i].shape}, params));
  }
  for (std::size_t i = 0; i < made.joints.size(); ++i) add("joint_" + std::to_string(i), made.joints[i].shape);
  if (const auto removed = mended.tied.removed(); !removed.empty()) add("removed", capsules(removed));
  if (const auto struts = mended.tied.struts(); !struts.empty()) add("ties", capsules(struts));
  if (!mended.thickened.empty()) add("thickened", capsules(mended.thickened));
  if (!mended.pillars.empty()) add("pillars", shape(mended.pillars));
  if (!mended.drains.empty()) add("drains", mended.keep_out());
  // What cleaning changed: material that went, void that was filled.
  const Shape before = with_mends(distance_to(raw), b, mended);
  const Shape after = distance_to(made.solid);
  for (const auto& [name, change] :
       {std::pair("specks", subtract(before, after)), std::pair("pores", subtract(after, before))}) {
    const Solid changed = realize(change, body);
    if (changed.volume_mm3() > 0) result.push_back({name, changed});
  }
  result.push_back({"solid", made.solid});
  return result;
}

}  // namespace fibrolite
