// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/recipe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <tuple>

#include "fibrolite/error.h"
#include "fibrolite/ops/text.h"
#include "refusal.h"

namespace fibrolite {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::refusal;

std::string refusal_of(const std::string& json) {
  return refusal([&] { static_cast<void>(parse_recipe(json, Recipe{}, "mine.json")); });
}
std::string refusal_of_set(const std::string& assignment) {
  return refusal([&] { static_cast<void>(set(Recipe{}, assignment)); });
}

TEST(NearestName, DistancesCountedByHand) {
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("sitting", "kitten"), 3);
  EXPECT_EQ(edit_distance("hybird", "hybrid"), 1);  // two neighbours swapped
  EXPECT_EQ(edit_distance("TCS", "tcs"), 0);
  EXPECT_EQ(nearest_name("gyroyd", {"tcs", "gyroid", "cubic"}), "gyroid");
  EXPECT_EQ(nearest_name("x", {}), "");
}

TEST(Presets, HoldTheNumbersTheyPromise) {
  EXPECT_EQ(preset_names().front(), "default");
  EXPECT_EQ(to_json(preset("default")), to_json(Recipe{}));
  EXPECT_EQ(preset("paper").partition.threshold, 0.26);
  EXPECT_TRUE(preset("paper").verify.world_axes);
  EXPECT_EQ(preset("paper").joint.bridge, Bridge::Bbox);
  EXPECT_FALSE(preset("paper").tcs.stretch_z);
  EXPECT_TRUE(preset("fdm").tcs.stretch_z);
  EXPECT_EQ(preset("peer-tcs").tcs.cell_mm, 5);
  EXPECT_EQ(preset("peer-tcs").tcs.stick_mm, 1.0);
  EXPECT_EQ(preset("peer-tcs").tcs.ball_mm, 1.6);
  EXPECT_EQ(preset("peer-tcs").shell.thickness_mm, 1.0);
  EXPECT_FALSE(preset("default").partition.threshold.has_value());
}

TEST(Presets, FillTheBodyAsTheirWorkDoes) {
  for (const std::string& name : preset_names())
    EXPECT_EQ(usual_infill(name), name == "peer-tcs" ? InfillKind::Tcs : InfillKind::Hybrid) << name;
  EXPECT_THROW(static_cast<void>(usual_infill("pear-tcs")), Error);
}

TEST(Presets, EachFitsItsOwnRules) {
  for (const std::string& name : preset_names())
    EXPECT_EQ(refusal([&] { check_recipe(preset(name), thinnest_mm(preset(name)) / 2); }), "") << name;
}

TEST(Presets, AnUnknownOneNamesTheNearest) {
  EXPECT_THAT(refusal([] { static_cast<void>(preset("papr")); }),
              AllOf(HasSubstr("'papr'"), HasSubstr("did you mean paper?")));
}

TEST(Recipe, ReadsBackWhatItPrints) {
  Recipe recipe = preset("paper");
  recipe.tcs.cell_mm = 1.0 / 3.0;
  recipe.tcs.shift_mm = {0.1, -2e-17, 5};
  recipe.mfs.micrograph = "/a folder/ü.png";
  recipe.seed = 18446744073709551615U;
  recipe.joint.enabled = false;
  const Recipe again = parse_recipe(to_json(recipe), Recipe{}, "printed");
  EXPECT_EQ(again.tcs.cell_mm, recipe.tcs.cell_mm);
  EXPECT_EQ(again.tcs.shift_mm, recipe.tcs.shift_mm);
  EXPECT_EQ(again.mfs.micrograph, recipe.mfs.micrograph);
  EXPECT_EQ(again.seed, recipe.seed);
  EXPECT_EQ(to_json(again), to_json(recipe));
}

TEST(Recipe, EveryKeyIsPrintedAndCanBeSetToWhatIsPrinted) {
  const auto printed = nlohmann::json::parse(to_json(Recipe{}));
  std::size_t leaves = 0;
  for (const auto& [group, value] : printed.items()) leaves += value.is_object() ? value.size() : 1;
  EXPECT_EQ(leaves, recipe_keys().size());
  for (const RecipeKey& about : recipe_keys()) {
    std::string pointer = "/" + about.key;
    if (const auto dot = pointer.find('.'); dot != std::string::npos) pointer[dot] = '/';
    const auto& value = printed.at(nlohmann::json::json_pointer(pointer));
    EXPECT_EQ(refusal_of_set(about.key + "=" + value.dump()), "");
    EXPECT_FALSE(about.range.empty()) << about.key;
    EXPECT_FALSE(about.doc.empty()) << about.key;
  }
}

TEST(Recipe, KeysLeftOutKeepTheBase) {
  const Recipe recipe = parse_recipe(R"({"tcs": {"stick_mm": 0.9}})", preset("peer-tcs"), "mine.json");
  EXPECT_EQ(recipe.tcs.stick_mm, 0.9);
  EXPECT_EQ(recipe.tcs.cell_mm, 5);
  EXPECT_EQ(to_json(parse_recipe("{}", preset("paper"), "mine.json")), to_json(preset("paper")));
}

TEST(Recipe, ThresholdIsAutoOrANumber) {
  EXPECT_FALSE(
      parse_recipe(R"({"partition": {"threshold": "auto"}})", preset("paper"), "x").partition.threshold.has_value());
  EXPECT_EQ(parse_recipe(R"({"partition": {"threshold": 0.3}})", Recipe{}, "x").partition.threshold, 0.3);
  EXPECT_THAT(refusal_of(R"({"partition": {"threshold": "atuo"}})"),
              HasSubstr("partition.threshold cannot be \"atuo\""));
}

TEST(Recipe, PartsAreFoundByShapeLoadOrBoth) {
  EXPECT_EQ(Recipe{}.partition.by, PartBy::Shape);
  const Recipe recipe = parse_recipe(
      R"({"partition": {"by": "load", "core_share": 0.4}, "mfs": {"fibre_mm": 3, "wall_mm": 0.5},
          "gyroid": {"cell_mm": 9, "density": 0.2},
          "loads": [{"name": "a", "supports": [{"where": {"lowest": {}}}], "forces": [{"gravity": "down"}]},
                    {"name": "b", "supports": [{"where": {"lowest": {}}}], "forces": [{"gravity": "up"}],
                     "unplanned": true}]})",
      Recipe{}, "x");
  EXPECT_EQ(recipe.partition.by, PartBy::Load);
  EXPECT_FALSE(recipe.verify.loads.at(0).unplanned);
  EXPECT_TRUE(recipe.verify.loads.at(1).unplanned);
  EXPECT_EQ(core_params(recipe).share, 0.4);
  EXPECT_EQ(core_params(recipe).least_mm, 7);  // two fibres and the walls on either side
  EXPECT_EQ(recipe.gyroid.density, 0.2);
  EXPECT_EQ(to_json(parse_recipe(to_json(recipe), Recipe{}, "printed")), to_json(recipe));
  EXPECT_EQ(set(recipe, "partition.by=both").partition.by, PartBy::Both);
  EXPECT_THAT(refusal_of_set("partition.by=form"), HasSubstr("\"shape\", \"load\" or \"both\""));
}

TEST(Recipe, CrystalsHaveAFormACellAndADensity) {
  const Recipe recipe = parse_recipe(
      R"({"tcs": {"form": "sheet", "cell_mm": [5, 6, 7.5], "density": 0.25, "grade": "surface"}})", Recipe{}, "x");
  EXPECT_EQ(recipe.tcs.form, TcsForm::Sheet);
  EXPECT_EQ(recipe.tcs.cell_mm, CellEdges(5, 6, 7.5));
  EXPECT_EQ(recipe.tcs.density, 0.25);
  EXPECT_EQ(recipe.tcs.grade, TcsGrade::Surface);
  EXPECT_EQ(to_json(parse_recipe(to_json(recipe), Recipe{}, "printed")), to_json(recipe));
  EXPECT_EQ(set(recipe, "tcs.cell_mm=4").tcs.cell_mm, CellEdges(4));
  EXPECT_FALSE(set(recipe, "tcs.density=auto").tcs.density.has_value());
  EXPECT_EQ(set(recipe, "tcs.form=network").tcs.form, TcsForm::Network);
  EXPECT_THAT(refusal_of_set("tcs.form=tube"), HasSubstr("\"sticks\", \"network\" or \"sheet\""));
  EXPECT_THAT(refusal_of_set("tcs.cell_mm=[5,6]"), HasSubstr("or three of them"));
  EXPECT_THAT(refusal_of_set("tcs.density=1.5"), HasSubstr("tcs.density"));
}

TEST(Recipe, OneSeedForAll) {
  EXPECT_EQ(set(Recipe{}, "seed=7").mfs.seed, 7U);
  EXPECT_EQ(parse_recipe(R"({"seed": 9})", Recipe{}, "x").mfs.seed, 9U);
}

TEST(Recipe, UnknownKeysNameThePlaceAndTheNearestKey) {
  EXPECT_THAT(
      refusal_of(R"({"tcs": {"cel_mm": 5}})"),
      AllOf(HasSubstr("unknown key tcs.cel_mm"), HasSubstr("mine.json"), HasSubstr("did you mean tcs.cell_mm?")));
  EXPECT_THAT(refusal_of(R"({"sed": 5})"), HasSubstr("did you mean seed?"));
  EXPECT_THAT(refusal_of(R"({"shel": {"thickness_mm": 2}})"), HasSubstr("unknown key shel"));
  EXPECT_THAT(refusal_of_set("joint.brige=mst"), HasSubstr("did you mean joint.bridge?"));
}

TEST(Recipe, WrongTypesAreRefused) {
  EXPECT_THAT(refusal_of(R"({"tcs": {"cell_mm": "5"}})"), HasSubstr("tcs.cell_mm cannot be \"5\""));
  EXPECT_THAT(refusal_of(R"({"tcs": {"cell_mm": null}})"), HasSubstr("tcs.cell_mm cannot be null"));
  EXPECT_THAT(refusal_of(R"({"tcs": 5})"), HasSubstr("tcs cannot be 5"));
  EXPECT_THAT(refusal_of(R"({"tcs": {"stretch_z": 1}})"), HasSubstr("true or false"));
  EXPECT_THAT(refusal_of(R"({"tcs": {"shift_mm": [1, 2]}})"), HasSubstr("[x, y, z]"));
  EXPECT_THAT(refusal_of(R"({"joint": {"bridge": "rope"}})"), HasSubstr("\"mst\" or \"bbox\""));
  EXPECT_THAT(refusal_of(R"({"seed": -1})"), HasSubstr("whole number"));
  EXPECT_THAT(refusal_of(R"({"seed": 1.5})"), HasSubstr("whole number"));
  EXPECT_THAT(refusal_of(R"({"mfs": {"template": ""}})"), HasSubstr("mfs.template"));
  EXPECT_THAT(refusal_of("[1, 2]"), HasSubstr("not a JSON object"));
}

TEST(Recipe, OutOfRangeIsRefusedAndTheEndsAreNot) {
  EXPECT_THAT(refusal_of(R"({"partition": {"threshold": 1.01}})"), HasSubstr("0 to 1"));
  EXPECT_EQ(refusal_of(R"({"partition": {"threshold": 1}})"), "");
  EXPECT_THAT(refusal_of(R"({"verify": {"dominance": 1}})"), HasSubstr("above 1"));
  EXPECT_THAT(refusal_of(R"({"verify": {"load_n": 0}})"), HasSubstr("above 0"));
  EXPECT_THAT(refusal_of(R"({"material": {"poisson": 0.5}})"), HasSubstr("0 to 0.49"));
  EXPECT_THAT(refusal_of(R"({"shell": {"thickness_mm": -1}})"), HasSubstr("shell.thickness_mm cannot be -1"));
}

TEST(Recipe, NoNumberThatIsNone) {
  EXPECT_NE(refusal_of(R"({"tcs": {"cell_mm": NaN}})"), "");
  EXPECT_NE(refusal_of(R"({"tcs": {"cell_mm": 1e999}})"), "");
  for (const char* value : {"nan", "NaN", "inf", "-inf", "1e999", "0x10", "5mm", "", "1,5"})
    EXPECT_THAT(refusal_of_set(std::string("tcs.cell_mm=") + value), HasSubstr("tcs.cell_mm cannot be")) << value;
}

TEST(Recipe, BrokenJsonSaysWhereInOneLine) {
  const std::string message = refusal_of("{\n \"tcs\": {\n \"cell_mm\": 5,,\n}}");
  EXPECT_THAT(message, AllOf(HasSubstr("line 3"), HasSubstr("mine.json")));
  EXPECT_EQ(message.find('\n'), std::string::npos);
  EXPECT_NE(refusal_of(""), "");
}

TEST(Recipe, AKeyGivenTwiceIsRefused) {
  EXPECT_THAT(refusal_of(R"({"tcs": {"cell_mm": 5, "cell_mm": 6}})"), HasSubstr("cell_mm appears twice"));
  EXPECT_EQ(refusal_of(R"({"tcs": {"cell_mm": 5}, "seed": 1})"), "");
}

TEST(Set, TakesPlainWordsAndPaths) {
  EXPECT_EQ(set(Recipe{}, "tcs.cell_mm=5").tcs.cell_mm, 5);
  EXPECT_EQ(set(Recipe{}, "joint.bridge=bbox").joint.bridge, Bridge::Bbox);
  EXPECT_EQ(set(Recipe{}, "mfs.template=/a/b=c.png").mfs.micrograph, "/a/b=c.png");
  EXPECT_EQ(set(Recipe{}, "tcs.shift_mm=[1,2,3]").tcs.shift_mm, (Vec3d{1, 2, 3}));
  EXPECT_FALSE(set(preset("paper"), "partition.threshold=auto").partition.threshold.has_value());
}

TEST(Set, RefusesWhatIsNoAssignment) {
  EXPECT_THAT(refusal_of_set("tcs.cell_mm"), HasSubstr("no value"));
  EXPECT_THAT(refusal_of_set("tcs=5"), HasSubstr("one of its keys"));
  EXPECT_NE(refusal_of_set("=5"), "");
}

/// Every selector, every kind of force.
constexpr const char* all_loads = R"({"loads": [
  {"name": "clamp",
   "supports": [{"where": {"lowest": {"share": 0.1, "along": [0, 1, 0]}}},
                {"where": {"half_space": {"point_mm": [1, 2, 3], "normal": [0, 0, -1]}}, "sliding": "up"}],
   "forces": [{"force_n": 110, "direction": [0.3, 0, -1],
               "where": {"seen_from": "up", "box_mm": [[0, 0, 0], [9, 9, 9]]}},
              {"pressure_mpa": 0.25, "where": {"highest": {"share": 0.5}, "label": 2}},
              {"gravity": "down"}]},
  {"name": "push",
   "supports": [{"where": {"lowest": {}}}],
   "forces": [{"force_n": 5, "direction": "slanted", "where": {"half_space": [
      {"point_mm": [0, 0, 0], "normal": [1, 0, 0]}, {"point_mm": [0.1, 0, 0], "normal": [-1, 0, 0]}]}}]}]})";

TEST(Loads, AreReadAndPrintedWhole) {
  const Recipe recipe = parse_recipe(all_loads, Recipe{}, "x");
  ASSERT_EQ(recipe.verify.loads.size(), 2U);
  const LoadCase& clamp = recipe.verify.loads[0];
  EXPECT_EQ(clamp.name, "clamp");
  ASSERT_EQ(clamp.supports.size(), 2U);
  EXPECT_EQ(clamp.supports[0].where.lowest->share, 0.1);
  EXPECT_EQ(clamp.supports[0].where.lowest->along.vector, (Vec3d{0, 1, 0}));
  EXPECT_FALSE(clamp.supports[0].sliding.has_value());
  EXPECT_EQ(clamp.supports[1].where.half_spaces.at(0).normal, (Vec3d{0, 0, -1}));
  EXPECT_EQ(clamp.supports[1].sliding->of, Direction::Of::Up);
  ASSERT_EQ(clamp.forces.size(), 3U);
  const auto& total = std::get<TotalForce>(clamp.forces[0]);
  EXPECT_EQ(total.newton, 110);
  EXPECT_EQ(total.direction.vector, (Vec3d{0.3, 0, -1}));
  EXPECT_EQ(total.where.seen_from->of, Direction::Of::Up);
  EXPECT_EQ(total.where.box_mm->max, (Vec3d{9, 9, 9}));
  EXPECT_EQ(std::get<Pressure>(clamp.forces[1]).mpa, 0.25);
  EXPECT_EQ(std::get<Pressure>(clamp.forces[1]).where.label, 2);
  EXPECT_EQ(std::get<Gravity>(clamp.forces[2]).direction.of, Direction::Of::Down);
  EXPECT_EQ(recipe.verify.loads[1].supports[0].where.lowest->share, 0.05);
  EXPECT_EQ(std::get<TotalForce>(recipe.verify.loads[1].forces[0]).where.half_spaces.size(), 2U);

  const std::string printed = to_json(recipe);
  EXPECT_EQ(to_json(parse_recipe(printed, Recipe{}, "printed")), printed);
  EXPECT_EQ(to_json(parse_recipe(R"({"loads": "paper-verify"})", recipe, "x")), to_json(Recipe{}));
}

TEST(Loads, ByNameAndBySet) {
  EXPECT_EQ(set(Recipe{}, "loads=stand").verify.loads.size(), 1U);
  EXPECT_EQ(std::get<TotalForce>(set(Recipe{}, "loads=paper-compare").verify.loads.at(0).forces.at(0)).newton, 110);
  EXPECT_TRUE(set(set(Recipe{}, "loads=stand"), "loads=paper-verify").verify.loads.empty());
  EXPECT_EQ(
      set(Recipe{}, R"(loads=[{"name": "a", "supports": [{"where": {"lowest": {}}}], "forces": [{"gravity": "up"}]}])")
          .verify.loads.size(),
      1U);
  EXPECT_THAT(refusal_of_set("loads=paper-compar"), HasSubstr("did you mean paper-compare?"));
}

TEST(Loads, MistakesNameThePlaceAndTheNearestKey) {
  const auto with = [](const std::string& supports, const std::string& forces) {
    return refusal_of(R"({"loads": [{"name": "a", "supports": )" + supports + R"(, "forces": )" + forces + "}]}");
  };
  const std::string foot = R"([{"where": {"lowest": {}}}])", weight = R"([{"gravity": "down"}])";
  EXPECT_EQ(with(foot, weight), "");
  EXPECT_THAT(with("[]", weight), AllOf(HasSubstr("load case 'a' has no support"), HasSubstr("loads[0].supports")));
  EXPECT_THAT(with(foot, "[]"), HasSubstr("load case 'a' has no force"));
  EXPECT_THAT(with(R"([{"where": {}}])", weight), HasSubstr("selects by nothing"));
  EXPECT_THAT(with(R"([{"where": {"lowst": {}}}])", weight),
              AllOf(HasSubstr("unknown key loads[0].supports[0].where.lowst"), HasSubstr("did you mean lowest?"),
                    HasSubstr("mine.json")));
  EXPECT_THAT(with(foot, R"([{"force": 3}])"), HasSubstr("did you mean force_n?"));
  EXPECT_THAT(with(foot, R"([{"presure_mpa": 3}])"), HasSubstr("did you mean pressure_mpa?"));
  EXPECT_THAT(with(foot, R"([{"direction": "down"}])"), HasSubstr("force_n, pressure_mpa or gravity"));
  EXPECT_THAT(with(foot, R"([{"gravity": "down", "force_n": 1}])"), HasSubstr("one of"));
  EXPECT_THAT(with(foot, R"([{"gravity": "left"}])"), AllOf(HasSubstr("forces[0].gravity"), HasSubstr("slanted")));
  EXPECT_THAT(with(foot, R"([{"gravity": [0, 0, 0]}])"), HasSubstr("without length"));
  EXPECT_THAT(with(foot, R"([{"force_n": "1", "where": {"lowest": {}}}])"), HasSubstr("forces[0].force_n"));
  EXPECT_THAT(with(foot, R"([{"pressure_mpa": 1, "where": {"box_mm": [[0, 0, 0]]}}])"), HasSubstr("box_mm"));
  EXPECT_THAT(with(foot, R"([{"pressure_mpa": 1, "where": {"label": -1}}])"), HasSubstr("where.label"));
  EXPECT_THAT(with(R"({"where": 1})", weight), HasSubstr("loads[0].supports cannot be"));
  EXPECT_THAT(refusal_of(R"({"loads": 5})"), HasSubstr("loads cannot be 5"));
  EXPECT_THAT(refusal_of(R"({"loads": []})"), HasSubstr("loads cannot be []"));
  EXPECT_THAT(refusal_of(R"({"loads": [{"nam": "a"}]})"), HasSubstr("did you mean name?"));
}

TEST(Materials, ByNameAndByNumber) {
  EXPECT_EQ(parse_recipe(R"({"material": "PETG"})", Recipe{}, "x").material, material("PETG"));
  EXPECT_EQ(set(Recipe{}, "material=AlSi10Mg").material, material("AlSi10Mg"));
  EXPECT_EQ(parse_recipe(R"({"material": {"yield_mpa": 40}})", set(Recipe{}, "material=PETG"), "x").material.young_mpa,
            material("PETG").young_mpa);
  EXPECT_THAT(refusal_of(R"({"material": "PEGT"})"), HasSubstr("did you mean PETG?"));
  EXPECT_THAT(refusal_of_set("material=steel"), HasSubstr("no material is called 'steel'"));
  EXPECT_NE(refusal_of(R"({"material": 5})"), "");
  EXPECT_THAT(refusal_of(R"({"material": {"density_g_cm3": 0}})"), HasSubstr("material.density_g_cm3"));
  EXPECT_THAT(refusal_of(R"({"material": {"yield_mpa": -1}})"), HasSubstr("material.yield_mpa"));
}

/// docs/loads.md promises: its examples are recipes, its table is the one in the code.
TEST(Loads, ThePageAboutThemHolds) {
  std::ifstream in(std::filesystem::path(FIBROLITE_ASSETS).parent_path() / "docs" / "loads.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  int examples = 0;
  const std::string fence = "```json\n";
  for (std::size_t at = page.find(fence); at != std::string::npos; at = page.find(fence, at + 1), ++examples) {
    const std::size_t begin = at + fence.size();
    EXPECT_EQ(refusal_of(page.substr(begin, page.find("```", begin) - begin)), "");
  }
  EXPECT_EQ(examples, 2);
  for (const NamedMaterial& row : materials()) {
    const Material& m = row.material;
    const std::string numbers = " | " + number_text(m.density_g_cm3) + " | " + number_text(m.young_mpa) + " | ";
    const auto at = page.find("| `" + row.name + "`");
    ASSERT_NE(at, std::string::npos) << row.name;
    const std::string line = page.substr(at, page.find('\n', at) - at);
    EXPECT_THAT(line, HasSubstr(numbers));
    EXPECT_THAT(line, HasSubstr(" | " + number_text(m.yield_mpa) + " | "));
    EXPECT_NEAR(std::stod(line.substr(line.find(numbers) + numbers.size())), m.poisson, 1e-12);
  }
}

TEST(CheckRecipe, TwoVoxelsIsTheLimit) {
  EXPECT_EQ(refusal([] { check_recipe(Recipe{}, 0.4); }), "");  // sticks and walls of 0.8 mm
  EXPECT_THAT(refusal([] { check_recipe(Recipe{}, 0.41); }),
              AllOf(HasSubstr("thinner than 2 voxels"), HasSubstr("0.82")));
  EXPECT_THAT(refusal([] { check_recipe(set(Recipe{}, "tcs.stick_mm=0.3"), 0.25); }),
              HasSubstr("tcs.stick_mm is 0.3 mm"));
}

TEST(CheckRecipe, OfASheetItIsTheWall) {
  const Recipe sheet = set(set(Recipe{}, "tcs.form=sheet"), "tcs.wall_mm=0.3");
  EXPECT_DOUBLE_EQ(thinnest_mm(sheet, InfillKind::Tcs), 0.3);
  EXPECT_THAT(refusal([&] { check_recipe(sheet, 0.2); }), HasSubstr("tcs.wall_mm is 0.3 mm"));
  EXPECT_EQ(refusal([&] { check_recipe(sheet, 0.15, InfillKind::Tcs); }), "");
  const Recipe light = set(sheet, "tcs.density=0.1");  // 3.84 walls to a cell of 6 mm: 0.157 mm
  EXPECT_NEAR(thinnest_mm(light, InfillKind::Tcs), 0.157, 0.002);
  EXPECT_THAT(refusal([&] { check_recipe(light, 0.1); }), HasSubstr("tcs.density makes members of 0.15"));
  EXPECT_THAT(refusal([&] { check_recipe(set(sheet, "tcs.density=0.99"), 0, InfillKind::Tcs); }),
              HasSubstr("no walls give a density of 0.99"));
}

TEST(CheckRecipe, OfAGradedCrystalBothEndsCount) {
  const Recipe graded = set(set(Recipe{}, "tcs.grade=surface"), "tcs.grade_least=0.5");
  const auto refused = [&](const char* change) {
    return refusal([&] { check_recipe(set(graded, change), 0.2, InfillKind::Tcs); });
  };
  EXPECT_EQ(refused("tcs.grade_most=1.8"), "");
  EXPECT_DOUBLE_EQ(thinnest_mm(graded, InfillKind::Tcs), 0.4);
  EXPECT_THAT(refused("tcs.grade_most=2"), HasSubstr("tcs.cell_mm is 6, too small for sticks of 1.6"));
  EXPECT_THAT(refused("tcs.grade_most=0.4"), HasSubstr("use 0.5 or more (tcs.grade_least)"));
  EXPECT_THAT(refused("tcs.grade_depth_mm=5"), HasSubstr("use 6 or more (tcs.cell_mm)"));
  EXPECT_THAT(refused("tcs.grade_least=0.3"), HasSubstr("thinner than 2 voxels"));
}

TEST(CheckRecipe, OnlyWhatTheInfillUsesMatters) {
  Recipe thin;
  thin.tcs.stick_mm = 0.1;
  EXPECT_NE(refusal([&] { check_recipe(thin, 0.3, InfillKind::Tcs); }), "");
  EXPECT_NE(refusal([&] { check_recipe(thin, 0.3, InfillKind::Hybrid); }), "");
  EXPECT_EQ(refusal([&] { check_recipe(thin, 0.3, InfillKind::Mfs); }), "");
  EXPECT_EQ(refusal([&] { check_recipe(thin, 0.3, InfillKind::Solid); }), "");
  EXPECT_DOUBLE_EQ(thinnest_mm(thin, InfillKind::Hybrid), 0.1);
  EXPECT_DOUBLE_EQ(thinnest_mm(thin, InfillKind::Mfs), 0.8);
  EXPECT_DOUBLE_EQ(thinnest_mm(preset("peer-tcs"), InfillKind::Tcs), 1.0);
  EXPECT_TRUE(std::isinf(thinnest_mm(thin, InfillKind::Solid)));
  Recipe layer;
  layer.joint.layer_mm = 0.2;
  EXPECT_DOUBLE_EQ(thinnest_mm(layer), 0.2);
  layer.joint.enabled = false;
  EXPECT_DOUBLE_EQ(thinnest_mm(layer), 0.8);
}

TEST(CheckRecipe, NumbersMustFitEachOther) {
  const auto refused = [](const char* assignment) {
    return refusal([&] { check_recipe(set(Recipe{}, assignment), 0); });
  };
  EXPECT_THAT(refused("tcs.cell_mm=3.1"), HasSubstr("tcs.cell_mm"));
  EXPECT_EQ(refused("tcs.cell_mm=3.2"), "");
  EXPECT_THAT(refused("tcs.ball_mm=0.7"), HasSubstr("tcs.ball_mm"));
  EXPECT_EQ(refused("tcs.ball_mm=0.8"), "");
  EXPECT_THAT(refused("mfs.fibre_mm=1.6"), HasSubstr("mfs.fibre_mm"));
  EXPECT_EQ(refused("mfs.fibre_mm=1.61"), "");
  EXPECT_THAT(refused("mfs.gap_mm=1.6"), HasSubstr("mfs.fibre_mm"));
  EXPECT_EQ(refused("mfs.gap_mm=1.5"), "");
  EXPECT_THAT(refused("joint.spacing_mm=0.8"), HasSubstr("joint.spacing_mm"));
}

/// Columns, layer and bridges respect the minimum wall: refused, each by its own name, where a joint is made.
TEST(CheckRecipe, WhatJointsAddIsNoThinnerThanTheMinimumWall) {
  const auto refused = [](const Recipe& recipe, InfillKind infill = InfillKind::Hybrid) {
    return refusal([&] { check_recipe(recipe, 0, infill); });
  };
  for (const std::string key : {"joint.layer_mm", "joint.column_mm", "joint.min_wall_mm"}) {
    const Recipe thin = set(Recipe{}, key + "=0.3");
    EXPECT_THAT(refused(thin), AllOf(HasSubstr(key + " is 0.3 mm, thinner than print.wall_mm"),
                                     HasSubstr("use 0.4 or more, or a smaller print.wall_mm")));
    EXPECT_EQ(refused(set(thin, "print.wall_mm=0.3")), "");
    EXPECT_EQ(refused(set(Recipe{}, key + "=0.4")), "");
    EXPECT_EQ(refused(set(thin, "joint.enabled=false")), "");
    EXPECT_EQ(refused(thin, InfillKind::Tcs), "");
  }
  // A wider wall asked for counts as well, against numbers of the user's own.
  Recipe chosen = set(set(Recipe{}, "joint.column_mm=0.8"), "joint.min_wall_mm=0.8");
  EXPECT_EQ(refused(set(chosen, "print.wall_mm=0.8")), "");
  chosen = set(chosen, "print.wall_mm=0.9");
  EXPECT_THAT(refused(chosen), HasSubstr("joint.column_mm is 0.8 mm"));
  const Recipe alone = set(chosen, "joint.columns=false");
  EXPECT_THAT(refused(alone), HasSubstr("joint.min_wall_mm is 0.8 mm"));
  EXPECT_EQ(refused(set(alone, "joint.min_wall_mm=0.9")), "");
}

TEST(Recipe, LengthsOfJointsLeftOpenFollowTheWall) {
  for (const auto& [wall, layer, column, spacing] :
       {std::tuple{0.4, 1.2, 0.8, 3.0}, {1.0, 1.2, 1.0, 3.0}, {1.5, 1.5, 1.5, 3.0}, {2.0, 2.0, 2.0, 4.0}}) {
    const Recipe recipe = set(Recipe{}, "print.wall_mm=" + number_text(wall));
    const JointParams joint = joint_params(recipe);
    EXPECT_EQ(joint.layer_mm, layer);
    EXPECT_EQ(joint.column_mm, column);
    EXPECT_EQ(joint.min_wall_mm, column);
    EXPECT_EQ(joint.spacing_mm, spacing);
    EXPECT_EQ(refusal([&] { check_recipe(recipe, 0); }), "") << wall;
    EXPECT_EQ(to_json(with_joint_lengths(with_joint_lengths(recipe))), to_json(with_joint_lengths(recipe)));
  }
  // Whichever is said first.
  const Recipe chosen = parse_recipe(R"({"joint": {"column_mm": 1.4}, "print": {"wall_mm": 1.1}})", Recipe{}, "x");
  EXPECT_EQ(joint_params(chosen).column_mm, 1.4);
  EXPECT_EQ(joint_params(chosen).min_wall_mm, 1.1);
  EXPECT_EQ(joint_params(set(chosen, "joint.column_mm=auto")).column_mm, 1.1);
  EXPECT_EQ(joint_params(set(chosen, "joint.column_mm=2")).spacing_mm, 4);  // columns do not touch
  EXPECT_EQ(to_json(parse_recipe(to_json(chosen), Recipe{}, "printed")), to_json(chosen));
}

TEST(Recipe, ADrainIsAtLeastTwoVoxelsWideOrNone) {
  const Recipe drained = set(Recipe{}, "print.drain_mm=0.6");
  EXPECT_NO_THROW(check_recipe(drained, 0.3));
  EXPECT_THROW(check_recipe(drained, 0.31), Error);
  EXPECT_NO_THROW(check_recipe(set(Recipe{}, "print.drain_mm=0"), 0.31));
  EXPECT_FALSE(set(drained, "print.drain_mm=auto").print.drain_mm.has_value());
}

}  // namespace
}  // namespace fibrolite
