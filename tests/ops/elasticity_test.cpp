// SPDX-License-Identifier: GPL-3.0-or-later
#include "elasticity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string_view>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "models.h"

namespace fibrolite::fem {
namespace {

using ::testing::HasSubstr;

using testing::bricks;

TetMesh block(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, Vec3d size) {
  return bricks(nx, ny, nz, [&](Vec3d p) { return Vec3d{p.x * size.x, p.y * size.y, p.z * size.z}; });
}

/// Fixes the components in `axes` of all nodes for which `where` holds.
void fix(std::vector<Fixed>& fixed, const TetMesh& mesh, std::initializer_list<int> axes,
         const std::function<bool(Vec3d)>& where) {
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!where(mesh.nodes[node])) continue;
    for (const int axis : axes) fixed.push_back({node, axis});
  }
}

/// Traction (N/mm2) on the part of the surface where all corners satisfy `where`, by a rule exact for linear tractions.
std::vector<Vec3d> load_faces(const TetMesh& mesh, const std::function<bool(Vec3d)>& where,
                              const std::function<Vec3d(Vec3d at, Vec3d normal)>& traction) {
  std::vector<Vec3d> force(mesh.nodes.size());
  for (const TetFace& face : boundary(mesh)) {
    const Vec3d a = mesh.nodes[face.nodes[0]], b = mesh.nodes[face.nodes[1]], c = mesh.nodes[face.nodes[2]];
    if (!where(a) || !where(b) || !where(c)) continue;
    const Vec3d area = 0.5 * cross(b - a, c - a);
    for (int point = 0; point < 3; ++point) {
      std::array<double, 3> l{1.0 / 6, 1.0 / 6, 1.0 / 6};
      l[static_cast<std::size_t>(point)] = 2.0 / 3;
      const Vec3d t = traction(l[0] * a + l[1] * b + l[2] * c, normalized(area));
      const auto n = face_shape_functions(l);
      for (std::size_t i = 0; i < 6; ++i) {
        force[face.nodes[i]] = force[face.nodes[i]] + (norm(area) / 3 * n[i]) * t;
      }
    }
  }
  return force;
}

Vec3d mean_displacement(const TetMesh& mesh, const Solution& s, const std::function<bool(Vec3d)>& where) {
  Vec3d sum{};
  double count = 0;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!where(mesh.nodes[node])) continue;
    sum = sum + s.displacement_mm[node];
    ++count;
  }
  return sum / count;
}

/// A block held at its lowest face across `axis`, with one traction (N/mm2) on the highest.
struct Clamped {
  TetMesh mesh;
  std::vector<Fixed> fixed;
  LoadCase load;
};
Clamped clamped(TetMesh mesh, int axis, double highest, Vec3d traction) {
  Clamped out{std::move(mesh), {}, {}};
  fix(out.fixed, out.mesh, {0, 1, 2}, [=](Vec3d p) { return p[axis] == 0; });
  out.load.force_n = load_faces(
      out.mesh, [=](Vec3d p) { return p[axis] == highest; }, [=](Vec3d, Vec3d) { return traction; });
  return out;
}

constexpr Material steel_like{.young_mpa = 200000, .poisson = 0.3};

TEST(Elasticity, PatchTest) {
  // A mesh with its inner corners shaken, a linear displacement on its boundary: the inside must be linear too,
  // exactly.
  Random random(1, "patch");
  const TetMesh mesh = bricks(3, 3, 3, [&](Vec3d p) {
    const auto inside = [](double v) { return v > 0.01 && v < 0.99; };
    if (!inside(p.x) || !inside(p.y) || !inside(p.z)) return 10 * p;
    const auto shake = [&] { return 0.6 * (random.uniform() - 0.5); };
    return 10 * p + Vec3d{shake(), shake(), shake()};
  });
  const auto field = [](Vec3d p) {
    return 1e-3 * Vec3d{1 + 2 * p.x - 3 * p.y + 0.5 * p.z, -2 + p.x + 4 * p.y - p.z, 3 - 2 * p.x + p.y + 5 * p.z};
  };
  std::vector<Fixed> fixed;
  LoadCase load;
  for (const TetFace& face : boundary(mesh)) {
    for (const std::uint32_t node : face.nodes) {
      for (int axis = 0; axis < 3; ++axis) {
        fixed.push_back({node, axis});
        load.fixed_mm.push_back(field(mesh.nodes[node])[axis]);
      }
    }
  }
  const Solution s = solve(mesh, steel_like, fixed, {load}).front();
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    EXPECT_LT(norm(s.displacement_mm[node] - field(mesh.nodes[node])), 1e-8 * 0.05);
  }
  // Hooke's law by hand: strains 2, 4, 5 and shears (-3+1), (-1+1), (0.5-2), all 1e-3.
  const double mu = 200000 / 2.6, lambda = 200000 * 0.3 / (1.3 * 0.4), p = lambda * 11e-3;
  const Stress expected{p + 4e-3 * mu, p + 8e-3 * mu, p + 10e-3 * mu, -2e-3 * mu, 0, -1.5e-3 * mu};
  const std::vector<Stress> at_nodes = nodal_stress(mesh, steel_like, s.displacement_mm);
  for (std::size_t c = 0; c < 6; ++c) {
    for (const Stress& stress : s.centroid_stress) EXPECT_NEAR(stress[c], expected[c], 1e-8 * p);
    for (const Stress& stress : at_nodes) EXPECT_NEAR(stress[c], expected[c], 1e-8 * p);
  }
}

TEST(Elasticity, BarInTensionIsExact) {
  const TetMesh mesh = block(2, 2, 5, {4, 5, 50});
  std::vector<Fixed> fixed;
  fix(fixed, mesh, {2}, [](Vec3d p) { return p.z == 0; });
  fix(fixed, mesh, {0}, [](Vec3d p) { return p.x == 0; });
  fix(fixed, mesh, {1}, [](Vec3d p) { return p.y == 0; });
  LoadCase load;
  load.force_n = load_faces(
      mesh, [](Vec3d p) { return p.z == 50; }, [](Vec3d, Vec3d n) { return 100 * n; });
  const Solution s = solve(mesh, steel_like, fixed, {load}).front();
  for (const Stress& stress : s.centroid_stress) {
    EXPECT_NEAR(stress[2], 100, 1e-7);
    EXPECT_NEAR(von_mises(stress), 100, 1e-7);
    EXPECT_NEAR(normal_stress(stress, {1, 0, 0}), 0, 1e-7);
  }
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3d p = mesh.nodes[node];
    EXPECT_NEAR(s.displacement_mm[node].z, p.z * 100 / 200000, 1e-9);
    EXPECT_NEAR(s.displacement_mm[node].x, -0.3 * p.x * 100 / 200000, 1e-9);
  }
  EXPECT_LT(norm(s.imbalance_n), 1e-6 * 2000);
}

TEST(Elasticity, CantileverBendsAsTimoshenkoSays) {
  const double length = 100, width = 8, height = 10, force = 500;
  const auto [mesh, fixed, load] =
      clamped(block(20, 2, 2, {length, width, height}), 0, length, {0, 0, -force / (width * height)});
  const auto tip = [&](Vec3d p) { return p.x == length; };
  const Solution s = solve(mesh, steel_like, fixed, {load}).front();
  const double inertia = width * height * height * height / 12, shear_modulus = 200000 / 2.6;
  const double deflection = force * length * length * length / (3 * 200000 * inertia) +
                            force * length / (5.0 / 6 * width * height * shear_modulus);
  EXPECT_NEAR(-mean_displacement(mesh, s, tip).z, deflection, 0.02 * deflection);
  EXPECT_LT(norm(s.imbalance_n), 1e-6 * force);
  EXPECT_LT(s.residual, 1e-9);
  double moment = 0;  // the support answers with F * L about y
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    moment += cross(mesh.nodes[node], s.reaction_n[node]).y;
  }
  EXPECT_NEAR(std::abs(moment), force * length, 1e-6 * force * length);
}

TEST(Elasticity, ThickCylinderUnderPressureFollowsLame) {
  const double inner = 10, outer = 20, pressure = 50;
  const TetMesh mesh = bricks(8, 16, 1, [&](Vec3d p) {  // a quarter ring, plane strain
    const double r = inner + (outer - inner) * p.x, angle = p.y * std::numbers::pi / 2;
    return Vec3d{r * std::cos(angle), r * std::sin(angle), p.z};
  });
  std::vector<Fixed> fixed;
  fix(fixed, mesh, {2}, [](Vec3d) { return true; });
  fix(fixed, mesh, {0}, [](Vec3d p) { return std::abs(p.x) < 1e-9; });
  fix(fixed, mesh, {1}, [](Vec3d p) { return std::abs(p.y) < 1e-9; });
  const auto at = [](double r) { return [r](Vec3d p) { return std::abs(std::hypot(p.x, p.y) - r) < 1e-6; }; };
  LoadCase load;
  load.force_n = load_faces(mesh, at(inner), [&](Vec3d, Vec3d n) { return -pressure * n; });
  const Solution s = solve(mesh, steel_like, fixed, {load}).front();

  const double a = inner * inner * pressure / (outer * outer - inner * inner);
  const double radial = 1.3 / 200000 * (a * 0.4 * inner + a * outer * outer / inner);
  std::size_t met = 0;
  const std::vector<Stress> stress = nodal_stress(mesh, steel_like, s.displacement_mm);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3d p = mesh.nodes[node];
    if (at(inner)(p)) {
      ++met;
      EXPECT_NEAR(std::hypot(s.displacement_mm[node].x, s.displacement_mm[node].y), radial, 0.01 * radial);
    }
    const double r = std::hypot(p.x, p.y);
    if (r > 12 && r < 18) {
      EXPECT_NEAR(normal_stress(stress[node], Vec3d{-p.y / r, p.x / r, 0}), a * (1 + outer * outer / (r * r)),
                  0.03 * pressure);
    }
  }
  EXPECT_GE(met, 34U);
}

/// A smooth displacement, held on the whole surface, with the body force that it needs, spread over the nodes by the
/// shape functions: ten-node elements come nearer to it with the third power of their size.
TEST(Elasticity, ConvergesWithTheThirdPowerOfTheSize) {
  const Material material{.young_mpa = 1000, .poisson = 0.3};
  const double lambda = 1000 * 0.3 / (1.3 * 0.4), mu = 1000 / 2.6, k = std::numbers::pi;
  const auto wave = [&](Vec3d p) { return std::sin(k * p.x) * std::sin(k * p.y) * std::sin(k * p.z); };
  // u = (w, 0, 0): f = -div sigma.
  const auto body_force = [&](Vec3d p) {
    const double sx = std::sin(k * p.x), cx = std::cos(k * p.x), sy = std::sin(k * p.y), cy = std::cos(k * p.y),
                 sz = std::sin(k * p.z), cz = std::cos(k * p.z);
    return k * k *
           Vec3d{(lambda + 4 * mu) * sx * sy * sz, -(lambda + mu) * cx * cy * sz, -(lambda + mu) * cx * sy * cz};
  };
  // Exact for polynomials of degree 3 on a tetrahedron, used on the eight parts of each for more.
  const double a = 0.58541020, b = 0.13819660;
  std::vector<double> errors;
  for (const std::uint32_t n : {2U, 4U, 8U}) {
    const TetMesh mesh = block(n, n, n, {1, 1, 1});
    LoadCase load;
    load.force_n.assign(mesh.nodes.size(), {});
    const auto each_point = [&](std::size_t t, const auto& visit) {
      const auto& tet = mesh.tets[t];
      const double volume = dot(cross(mesh.nodes[tet[1]] - mesh.nodes[tet[0]], mesh.nodes[tet[2]] - mesh.nodes[tet[0]]),
                                mesh.nodes[tet[3]] - mesh.nodes[tet[0]]) /
                            6;
      for (std::size_t g = 0; g < 4; ++g) {
        std::array<double, 4> at{b, b, b, b};
        at[g] = a;
        Vec3d p{};
        for (std::size_t c = 0; c < 4; ++c) p = p + at[c] * mesh.nodes[tet[c]];
        visit(shape_functions(at), p, 0.25 * volume);
      }
    };
    std::vector<Fixed> fixed;
    fix(fixed, mesh, {0, 1, 2}, [](Vec3d p) {
      const auto side = [](double x) { return x < 1e-9 || x > 1 - 1e-9; };
      return side(p.x) || side(p.y) || side(p.z);
    });
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
      each_point(t, [&](const std::array<double, 10>& shape, Vec3d p, double weight) {
        for (std::size_t i = 0; i < 10; ++i)
          load.force_n[mesh.tets[t][i]] = load.force_n[mesh.tets[t][i]] + weight * shape[i] * body_force(p);
      });
    const Solution solution = solve(mesh, material, fixed, {load}).front();
    double sum = 0;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
      each_point(t, [&](const std::array<double, 10>& shape, Vec3d p, double weight) {
        Vec3d u{};
        for (std::size_t i = 0; i < 10; ++i) u = u + shape[i] * solution.displacement_mm[mesh.tets[t][i]];
        const Vec3d gap = u - Vec3d{wave(p), 0, 0};
        sum += weight * dot(gap, gap);
      });
    errors.push_back(std::sqrt(sum));
  }
  EXPECT_GE(std::log2(errors[1] / errors[2]), 2.7) << errors[0] << ' ' << errors[1] << ' ' << errors[2];
  EXPECT_LT(errors[2], 0.001);
}

TEST(Elasticity, ManyLoadsWithOneFactorisation) {
  const auto [mesh, fixed, push] = clamped(block(3, 2, 4, {6, 4, 9}), 2, 9, {3, 1, -2});
  LoadCase settle;
  settle.fixed_mm.assign(fixed.size(), 0);
  for (std::size_t k = 0; k < fixed.size(); ++k) settle.fixed_mm[k] = fixed[k].axis == 2 ? 0.25 : 0;
  const auto both = solve(mesh, steel_like, fixed, {push, settle});
  const auto alone = solve(mesh, steel_like, fixed, {push});
  ASSERT_EQ(both.size(), 2U);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    EXPECT_LT(norm(both[0].displacement_mm[node] - alone[0].displacement_mm[node]), 1e-12);
    EXPECT_LT(norm(both[1].displacement_mm[node] - Vec3d{0, 0, 0.25}), 1e-10);  // a rigid motion strains nothing
  }
  for (const Stress& stress : both[1].centroid_stress) EXPECT_LT(von_mises(stress), 1e-5);
}

TEST(Elasticity, SameBitsOnOneAndTwoThreads) {
  const auto [mesh, fixed, load] = clamped(block(6, 6, 6, {10, 11, 12}), 2, 12, {3, 1, -2});
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return solve(mesh, steel_like, fixed, {load}).front();
  };
  const Solution one = run(1), two = run(2);
  EXPECT_EQ(one.displacement_mm, two.displacement_mm);
  EXPECT_EQ(one.centroid_stress, two.centroid_stress);
  EXPECT_EQ(one.reaction_n, two.reaction_n);
}

/// The same answers from the solver for large bodies, however small the body.
constexpr SolveParams iterative{.direct_limit = 0};

void expect_same(const Solution& a, const Solution& b, double relative) {
  double largest = 0;
  for (const Vec3d u : a.displacement_mm) largest = std::max(largest, norm(u));
  ASSERT_GT(largest, 0);
  for (std::size_t node = 0; node < a.displacement_mm.size(); ++node) {
    ASSERT_LT(norm(a.displacement_mm[node] - b.displacement_mm[node]), relative * largest) << node;
  }
}

TEST(IterativeElasticity, CantileverBendsAsTimoshenkoSays) {
  const double length = 100, width = 8, height = 10, force = 500;
  const auto [mesh, fixed, load] =
      clamped(block(24, 4, 4, {length, width, height}), 0, length, {0, 0, -force / (width * height)});
  const auto tip = [&](Vec3d p) { return p.x == length; };
  const Solution s = solve(mesh, steel_like, fixed, {load}, iterative).front();
  const double inertia = width * height * height * height / 12, shear_modulus = 200000 / 2.6;
  const double deflection = force * length * length * length / (3 * 200000 * inertia) +
                            force * length / (5.0 / 6 * width * height * shear_modulus);
  EXPECT_NEAR(-mean_displacement(mesh, s, tip).z, deflection, 0.01 * deflection);
  EXPECT_LT(norm(s.imbalance_n), 1e-6 * force);
  EXPECT_LT(s.residual, 1e-9);
  EXPECT_LT(s.iterations, 40);
  const Solution direct = solve(mesh, steel_like, fixed, {load}).front();
  EXPECT_EQ(direct.iterations, 0);
  expect_same(direct, s, 1e-6);
}

TEST(IterativeElasticity, TakesOverAboveTheLimit) {
  const TetMesh mesh = block(16, 11, 11, {20, 14, 14});  // 33 * 23 * 23 nodes
  ASSERT_GT(3 * static_cast<std::int64_t>(mesh.nodes.size()), SolveParams{}.direct_limit);
  std::vector<Fixed> fixed;  // a bar in tension, free to grow thin: its answer is exact
  fix(fixed, mesh, {0}, [](Vec3d p) { return p.x == 0; });
  fix(fixed, mesh, {1}, [](Vec3d p) { return p.y == 0; });
  fix(fixed, mesh, {2}, [](Vec3d p) { return p.z == 0; });
  LoadCase load;
  load.force_n = load_faces(
      mesh, [](Vec3d p) { return p.x == 20; }, [](Vec3d, Vec3d n) { return 100 * n; });
  const Solution s = solve(mesh, steel_like, fixed, {load}).front();
  EXPECT_GT(s.iterations, 0);
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    const Vec3d p = mesh.nodes[node];
    ASSERT_LT(norm(s.displacement_mm[node] - 100.0 / 200000 * Vec3d{p.x, -0.3 * p.y, -0.3 * p.z}), 1e-9);
  }
  EXPECT_LT(norm(s.imbalance_n), 1e-6 * 100 * 14 * 14);
}

TEST(IterativeElasticity, ManyLoadsAndSettlementsEqualCholesky) {
  Random random(2, "iterative");
  const TetMesh mesh = bricks(5, 4, 6, [&](Vec3d p) {
    const auto shake = [&](double v) { return v > 0.01 && v < 0.99 ? 0.5 * (random.uniform() - 0.5) : 0.0; };
    return Vec3d{10 * p.x + shake(p.x), 8 * p.y + shake(p.y), 12 * p.z + shake(p.z)};
  });
  std::vector<Fixed> fixed;
  fix(fixed, mesh, {0, 1, 2}, [](Vec3d p) { return p.z == 0; });
  fix(fixed, mesh, {1}, [](Vec3d p) { return p.x == 10; });
  const auto top = [](Vec3d p) { return p.z == 12; };
  LoadCase push, twist, settle, tilt;
  push.force_n = load_faces(mesh, top, [](Vec3d, Vec3d) { return Vec3d{3, 1, -2}; });
  twist.force_n = load_faces(mesh, top, [](Vec3d at, Vec3d) { return Vec3d{4 - at.y, at.x - 5, 0}; });
  settle.fixed_mm.assign(fixed.size(), 0.25);
  for (const Fixed& f : fixed) tilt.fixed_mm.push_back(f.axis == 1 ? 0.01 * mesh.nodes[f.node].x : 0);
  const std::vector<LoadCase> cases{push, twist, settle, tilt};
  const auto direct = solve(mesh, steel_like, fixed, cases), other = solve(mesh, steel_like, fixed, cases, iterative);
  ASSERT_EQ(other.size(), 4U);
  for (std::size_t c = 0; c < 4; ++c) {
    expect_same(direct[c], other[c], 1e-6);
    EXPECT_LT(other[c].residual, 1e-6);
  }
  for (const Vec3d u : other[2].displacement_mm) EXPECT_LT(norm(u - Vec3d{0.25, 0.25, 0.25}), 1e-9);
}

/// Held at middles of edges only: the coarse level has no corner that is held and must learn it from the elements.
TEST(IterativeElasticity, SupportsOnMiddlesOfEdgesCount) {
  const TetMesh mesh = block(4, 4, 4, {4, 4, 4});
  std::vector<bool> middle(mesh.nodes.size(), false);
  for (const auto& tet : mesh.tets) {
    for (std::size_t k = 4; k < 10; ++k) middle[tet[k]] = true;
  }
  std::vector<Fixed> fixed;
  for (std::uint32_t node = 0; node < mesh.nodes.size(); ++node) {
    if (!middle[node] || mesh.nodes[node].z != 0) continue;
    for (int axis = 0; axis < 3; ++axis) fixed.push_back({node, axis});
  }
  LoadCase load;
  load.force_n = load_faces(
      mesh, [](Vec3d p) { return p.z == 4; },
      [](Vec3d, Vec3d) {
        return Vec3d{3, 1, -2};
      });
  const Solution s = solve(mesh, steel_like, fixed, {load}, iterative).front();
  expect_same(solve(mesh, steel_like, fixed, {load}).front(), s, 1e-6);
  EXPECT_LT(s.iterations, 60);
}

TEST(IterativeElasticity, SameBitsOnOneAndTwoThreads) {
  const auto [mesh, fixed, load] = clamped(block(9, 8, 10, {10, 11, 12}), 2, 12, {3, 1, -2});
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return solve(mesh, steel_like, fixed, {load}, iterative).front();
  };
  const Solution one = run(1), two = run(2);
  EXPECT_EQ(one.iterations, two.iterations);
  EXPECT_EQ(one.displacement_mm, two.displacement_mm);
  EXPECT_EQ(one.centroid_stress, two.centroid_stress);
  EXPECT_EQ(one.reaction_n, two.reaction_n);
}

TEST(IterativeElasticity, NearlyIncompressibleIsSlowerButRight) {
  const Material rubber{.young_mpa = 10, .poisson = 0.49};
  const auto [mesh, fixed, load] = clamped(block(12, 4, 4, {30, 8, 8}), 0, 30, {0, 0, -0.01});
  const Solution s = solve(mesh, rubber, fixed, {load}, iterative).front();
  expect_same(solve(mesh, rubber, fixed, {load}).front(), s, 1e-6);
  EXPECT_LT(s.iterations, 200);
}

TEST(IterativeElasticity, ProgressRisesToOneAndCancelIsSeen) {
  const auto [mesh, fixed, load] = clamped(block(8, 8, 8, {10, 10, 10}), 2, 10, {1, 0, 0});
  std::vector<double> seen;
  const Context watched([&](double f, std::string_view) { seen.push_back(f); }, {});
  static_cast<void>(solve(mesh, steel_like, fixed, {load, load}, iterative, watched));
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_GT(seen.size(), 10U);
  EXPECT_EQ(seen.back(), 1);
  Context* handle = nullptr;
  Context stopped(
      [&](double f, std::string_view) {
        if (f > 0.4) handle->cancel();
      },
      {});
  handle = &stopped;
  try {
    static_cast<void>(solve(mesh, steel_like, fixed, {load}, iterative, stopped));
    FAIL() << "a cancelled solve ended";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Cancelled);
  }
}

/// Two blocks that share an edge and no more: the second can swing, whichever solver is asked.
TEST(IterativeElasticity, ABodyThatHangsByAnEdgeIsRefused) {
  TetMesh mesh = block(3, 3, 3, {3, 3, 3});
  const TetMesh other = bricks(3, 3, 3, [](Vec3d p) { return Vec3d{3 + 3 * p.x, 3 * p.y, 3 + 3 * p.z}; });
  std::vector<std::uint32_t> number;
  for (const Vec3d p : other.nodes) {
    const auto same = std::find_if(mesh.nodes.begin(), mesh.nodes.end(), [&](Vec3d q) { return norm(p - q) < 1e-9; });
    number.push_back(static_cast<std::uint32_t>(same - mesh.nodes.begin()));
    if (same == mesh.nodes.end()) mesh.nodes.push_back(p);
  }
  for (auto tet : other.tets) {
    for (auto& node : tet) node = number[node];
    mesh.tets.push_back(tet);
  }
  const Clamped swing = clamped(mesh, 2, 6, {0, 0, -1});
  for (const SolveParams& params : {SolveParams{}, iterative}) {
    try {
      static_cast<void>(solve(swing.mesh, steel_like, swing.fixed, {swing.load}, params));
      FAIL() << "a swing was solved, limit " << params.direct_limit;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::SolverFailed);
      EXPECT_THAT(error.what(), HasSubstr("hang by a point or an edge"));
    }
  }
}

TEST(Elasticity, WhatFloatsIsNamed) {
  TetMesh mesh = block(1, 1, 1, {2, 2, 2});
  const TetMesh other = bricks(1, 1, 1, [](Vec3d p) { return p + Vec3d{7, 8, 9}; });
  const auto shift = static_cast<std::uint32_t>(mesh.nodes.size());
  mesh.nodes.insert(mesh.nodes.end(), other.nodes.begin(), other.nodes.end());
  for (auto tet : other.tets) {
    for (auto& node : tet) node += shift;
    mesh.tets.push_back(tet);
  }
  std::vector<Fixed> fixed;
  fix(fixed, mesh, {0, 1, 2}, [](Vec3d p) { return p.z == 0; });
  for (const SolveParams& params : {SolveParams{}, iterative}) {
    try {
      static_cast<void>(solve(mesh, steel_like, fixed, {LoadCase{}}, params));
      FAIL() << "a floating piece was solved";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::SolverFailed);
      EXPECT_THAT(error.what(), HasSubstr("not held"));
      EXPECT_THAT(error.what(), HasSubstr("(8, 9, 10)"));
    }
  }
}

TEST(Elasticity, AHingeIsNotASupport) {
  const TetMesh mesh = block(2, 2, 2, {2, 2, 2});
  std::vector<Fixed> edge, face;
  fix(edge, mesh, {0, 1, 2}, [](Vec3d p) { return p.z == 0 && p.x == 0; });
  fix(face, mesh, {0, 1, 2}, [](Vec3d p) { return p.z == 0; });
  EXPECT_THROW(static_cast<void>(solve(mesh, steel_like, edge, {LoadCase{}})), Error);
  EXPECT_NO_THROW(static_cast<void>(solve(mesh, steel_like, face, {LoadCase{}})));
}

TEST(Elasticity, MaterialOutOfRangeIsRefused) {
  const TetMesh mesh = block(1, 1, 1, {2, 2, 2});
  for (const Material bad : {Material{.young_mpa = 0}, Material{.poisson = 0.5}, Material{.young_mpa = NAN}}) {
    try {
      static_cast<void>(solve(mesh, bad, {}, {LoadCase{}}));
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadRecipe);
    }
  }
}

TEST(TetMesh, BoundaryAndVolumeOfABlock) {
  const TetMesh mesh = block(3, 4, 5, {1, 2, 3});
  EXPECT_NEAR(volume_mm3(mesh), 6, 1e-12);
  const auto surface = boundary(mesh);
  EXPECT_EQ(surface.size(), 2U * 2U * (12U + 20U + 15U));
  Vec3d closed{};
  double area = 0;
  for (const TetFace& f : surface) {
    const Vec3d a = mesh.nodes[f.nodes[0]], b = mesh.nodes[f.nodes[1]], c = mesh.nodes[f.nodes[2]];
    const Vec3d n = 0.5 * cross(b - a, c - a);
    EXPECT_GT(dot(n, (a + b + c) / 3 - Vec3d{0.5, 1, 1.5}), 0);
    EXPECT_LT(norm(mesh.nodes[f.nodes[3]] - 0.5 * (a + b)), 1e-15);
    EXPECT_LT(norm(mesh.nodes[f.nodes[4]] - 0.5 * (b + c)), 1e-15);
    EXPECT_LT(norm(mesh.nodes[f.nodes[5]] - 0.5 * (c + a)), 1e-15);
    closed = closed + n;
    area += norm(n);
  }
  EXPECT_NEAR(area, 22, 1e-12);
  EXPECT_LT(norm(closed), 1e-12);
}

}  // namespace
}  // namespace fibrolite::fem
