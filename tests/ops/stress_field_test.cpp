// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/stress_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "elasticity.h"
#include "fibrolite/random.h"
#include "models.h"
#include "run_program.h"

namespace fibrolite {
namespace {

using testing::TempDir;

TEST(Stress, principal_stresses_and_von_mises_of_known_states) {
  const auto uniaxial = principal_stresses({10, 0, 0, 0, 0, 0});
  EXPECT_NEAR(uniaxial[0], 10, 1e-12);
  EXPECT_NEAR(uniaxial[2], 0, 1e-12);
  const auto shear = principal_stresses({0, 0, 0, 7, 0, 0});
  EXPECT_NEAR(shear[0], 7, 1e-12);
  EXPECT_NEAR(shear[1], 0, 1e-12);
  EXPECT_NEAR(shear[2], -7, 1e-12);
  EXPECT_NEAR(von_mises({0, 0, 0, 7, 0, 0}), 7 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(von_mises({5, 5, 5, 0, 0, 0}), 0, 1e-12);
}

/// A crooked bar, its foot held, its end pulled about by uneven forces, in two load cases.
StressField crooked_bar() {
  StressField field;
  field.mesh = testing::bricks(3, 3, 8, [](Vec3d p) {
    return Vec3d{10 * p.x + 6 * p.z * p.z, 8 * p.y * (1 + 0.3 * p.z), 40 * p.z + 2 * p.x * p.y};
  });
  field.material = {.young_mpa = 3500, .poisson = 0.36};
  for (const auto& tet : field.mesh.tets) field.part.push_back(field.mesh.nodes[tet[0]].z < 20 ? 0 : 1);
  std::vector<fem::Fixed> fixed;
  for (std::uint32_t n = 0; n < field.mesh.nodes.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (n % 11 == 0 && field.mesh.nodes[n].z < 2.1) fixed.push_back({n, axis});
  Random random(1, "bar");
  std::vector<fem::LoadCase> cases(2);
  for (fem::LoadCase& load : cases)
    for (const Vec3d p : field.mesh.nodes)
      load.force_n.push_back(p.z > 36 ? Vec3d{random.uniform() - 0.2, random.uniform() - 0.5, -random.uniform()}
                                      : Vec3d{});
  const auto solutions = fem::solve(field.mesh, field.material, fixed, cases);
  for (std::size_t c = 0; c < cases.size(); ++c) {
    StressField::Case& solved = field.cases.emplace_back();
    solved.name = c == 0 ? "one" : "two";
    for (const fem::Fixed& f : fixed) solved.fixed.push_back({f.node, f.axis});
    solved.force_n = cases[c].force_n;
    solved.displacement_mm = solutions[c].displacement_mm;
    solved.stress_mpa = fem::nodal_stress(field.mesh, field.material, solved.displacement_mm);
  }
  return field;
}

/// Tables of numbers in CalculiX's text output: for each step the rows under its headings.
struct Printed {
  std::vector<std::vector<Vec3d>> displacement;                     // per step, per node
  std::vector<std::vector<std::array<StressTensor, 4>>> at_points;  // per step, per element
};
Printed parse(const std::string& text, std::size_t nodes, std::size_t elements) {
  Printed printed;
  std::istringstream lines(text);
  enum { None, Displacements, Stresses } table = None;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("displacements") != std::string::npos) {
      table = Displacements;
      printed.displacement.emplace_back(nodes);
    } else if (line.find("stresses") != std::string::npos) {
      table = Stresses;
      printed.at_points.emplace_back(elements);
    } else if (std::istringstream cells(line); table == Displacements) {
      std::size_t node = 0;
      if (Vec3d u{}; cells >> node >> u.x >> u.y >> u.z) printed.displacement.back().at(node - 1) = u;
    } else if (table == Stresses) {
      std::size_t element = 0, point = 0;
      if (StressTensor s{}; cells >> element >> point >> s[0] >> s[1] >> s[2] >> s[3] >> s[5] >> s[4])
        printed.at_points.back().at(element - 1).at(point - 1) = s;
    }
  }
  return printed;
}

/// From the four integration points to the nodes as nodal_stress() does: linear in each element, then the mean of the
/// elements around, weighted by volume.
std::vector<StressTensor> recovered(const TetMesh& mesh, const std::vector<std::array<StressTensor, 4>>& points) {
  constexpr double a = 0.58541020, b = 0.13819660;
  constexpr std::array<std::array<std::size_t, 2>, 6> edges{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
  std::vector<StressTensor> result(mesh.nodes.size(), StressTensor{});
  std::vector<double> weight(mesh.nodes.size(), 0);
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& tet = mesh.tets[t];
    const Vec3d o = mesh.nodes[tet[0]];
    const double volume = dot(cross(mesh.nodes[tet[1]] - o, mesh.nodes[tet[2]] - o), mesh.nodes[tet[3]] - o) / 6;
    std::array<StressTensor, 10> at{};
    for (std::size_t c = 0; c < 6; ++c) {
      const double sum = points[t][0][c] + points[t][1][c] + points[t][2][c] + points[t][3][c];
      for (std::size_t i = 0; i < 4; ++i) at[i][c] = (points[t][i][c] - b * sum) / (a - b);
      for (std::size_t e = 0; e < 6; ++e) at[4 + e][c] = 0.5 * (at[edges[e][0]][c] + at[edges[e][1]][c]);
    }
    for (std::size_t i = 0; i < 10; ++i) {
      for (std::size_t c = 0; c < 6; ++c) result[tet[i]][c] += volume * at[i][c];
      weight[tet[i]] += volume;
    }
  }
  for (std::size_t n = 0; n < result.size(); ++n)
    for (double& c : result[n]) c /= weight[n];
  return result;
}

TEST(Deck, calculix_solves_it_to_the_same_answer) {
  const TempDir folder;
  const StressField field = crooked_bar();
  write_inp(folder / "case.inp", field);
  const testing::Finished run =
      testing::run_program("/bin/sh", {"-c", "cd '" + folder.path().string() + "' && exec ccx -i case"});
  if (run.code == 127) GTEST_SKIP() << "CalculiX is not installed";
  ASSERT_EQ(run.code, 0) << run.out << run.err;
  const Printed printed = parse(testing::content(folder / "case.dat"), field.mesh.nodes.size(), field.mesh.tets.size());
  ASSERT_EQ(printed.displacement.size(), 2U) << run.out;
  ASSERT_EQ(printed.at_points.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    const StressField::Case& ours = field.cases[c];
    const std::vector<StressTensor> theirs = recovered(field.mesh, printed.at_points[c]);
    double largest_u = 0, gap_u = 0, largest_s = 0, gap_s = 0;
    for (std::size_t n = 0; n < field.mesh.nodes.size(); ++n) {
      largest_u = std::max(largest_u, norm(printed.displacement[c][n]));
      gap_u = std::max(gap_u, norm(printed.displacement[c][n] - ours.displacement_mm[n]));
      largest_s = std::max(largest_s, von_mises(theirs[n]));
      gap_s = std::max(gap_s, std::abs(von_mises(theirs[n]) - von_mises(ours.stress_mpa[n])));
    }
    EXPECT_GT(largest_u, 0.01);
    EXPECT_LT(gap_u, 1e-4 * largest_u);  // six printed digits
    EXPECT_LT(gap_s, 1e-4 * largest_s);
  }
}

/// Turned into the world: a field given in a frame whose z is the world's x.
TEST(Vtu, stresses_and_displacements_turn_into_the_world) {
  const TempDir folder;
  StressField field;
  field.mesh = ten_node({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}});
  field.part = {3};
  field.frame = {{5, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  field.cases.push_back({"pull",
                         {},
                         {},
                         {},
                         std::vector<Vec3d>(10, Vec3d{0, 0, 2}),
                         std::vector<StressTensor>(10, StressTensor{0, 0, 9, 1, 2, 3})});
  write_vtu(folder / "a.vtu", field);
  const std::string all = testing::content(folder / "a.vtu");
  const std::string mark = "<AppendedData encoding=\"raw\">\n_";
  const auto values = [&](const std::string& name, std::size_t count) {
    const std::size_t element = all.find("Name=\"" + name + "\""), from = all.find("offset=\"", element) + 8;
    std::vector<double> list(count);
    std::memcpy(list.data(), all.data() + all.find(mark) + mark.size() + std::stoul(all.substr(from)) + 8,
                count * sizeof(double));
    return list;
  };
  EXPECT_EQ(values("Points", 3), (std::vector<double>{5, 0, 0}));
  EXPECT_EQ(values("displacement_mm pull", 3), (std::vector<double>{2, 0, 0}));
  EXPECT_EQ(values("stress_mpa pull", 6), (std::vector<double>{9, 0, 0, 3, 1, 2}));  // zz -> xx, zx -> xy, xy -> yz
  EXPECT_EQ(values("part", 1), std::vector<double>{3});
}

}  // namespace
}  // namespace fibrolite
