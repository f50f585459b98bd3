// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/tetrahedralize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>
#include <thread>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

using namespace testing;  // the shapes to build
using ::testing::HasSubstr;

/// Volumes of all tetrahedra, by hand.
std::vector<double> volumes(const TetMesh& mesh) {
  std::vector<double> result;
  for (const auto& t : mesh.tets) {
    const Vec3d a = mesh.nodes[t[0]];
    result.push_back(dot(cross(mesh.nodes[t[1]] - a, mesh.nodes[t[2]] - a), mesh.nodes[t[3]] - a) / 6);
  }
  return result;
}

void expect_sound(const TetMesh& mesh, const Mesh& surface) {
  ASSERT_FALSE(mesh.tets.empty());
  double total = 0;
  for (const double v : volumes(mesh)) {
    EXPECT_GT(v, 0);
    total += v;
  }
  EXPECT_NEAR(total, signed_volume(surface), 1e-3 * signed_volume(surface));
  EXPECT_EQ(boundary(mesh).size(), surface.triangles.size());  // not one triangle split, lost or added
  constexpr std::array<std::array<std::size_t, 2>, 6> edges{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
  std::vector<bool> used(mesh.nodes.size(), false);
  for (const auto& t : mesh.tets) {
    for (const std::uint32_t node : t) used[node] = true;
    for (std::size_t e = 0; e < 6; ++e) {
      const Vec3d middle = 0.5 * (mesh.nodes[t[edges[e][0]]] + mesh.nodes[t[edges[e][1]]]);
      EXPECT_LT(norm(mesh.nodes[t[4 + e]] - middle), 1e-12);
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

/// Throws SolverFailed and says `what`; the test itself proves that this process survived.
void expect_refused(const Mesh& mesh, const std::string& what, const TetrahedralizeParams& params = {}) {
  try {
    static_cast<void>(tetrahedralize(mesh, params));
    ADD_FAILURE() << "accepted: " << what;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::SolverFailed) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(what));
  }
}

TEST(Tetrahedralize, FillsBoxBallTubeAndTorus) {
  for (const Mesh& mesh : {cube(10), icosphere(10, 3), tube(5, 40, 32), torus_mesh(20, 5, 40, 20)}) {
    expect_sound(tetrahedralize(mesh), mesh);
  }
}

TEST(Tetrahedralize, AHollowBodyStaysHollow) {
  const Mesh mesh = joined(cube(10), flipped(cube(4, {3, 3, 3})));
  const TetMesh tets = tetrahedralize(mesh);
  expect_sound(tets, mesh);
  EXPECT_NEAR(volume_mm3(tets), 1000 - 64, 1e-9);
}

TEST(Tetrahedralize, SmallTetrahedraOnRequest) {
  const Mesh mesh = icosphere(10, 3);
  const TetMesh coarse = tetrahedralize(mesh);
  const TetMesh fine = tetrahedralize(mesh, {.max_volume_mm3 = 0.5});
  expect_sound(fine, mesh);
  // Those on the surface cannot be split without splitting its triangles; all others keep the limit.
  const std::vector<double> v = volumes(fine);
  EXPECT_LT(std::count_if(v.begin(), v.end(), [](double one) { return one > 0.5; }),
            0.01 * static_cast<double>(v.size()));
  EXPECT_GT(fine.tets.size(), 2 * coarse.tets.size());
}

TEST(Tetrahedralize, TheSameBitsAgain) {
  const Mesh mesh = icosphere(10, 3);
  const TetMesh a = tetrahedralize(mesh), b = tetrahedralize(mesh);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.tets, b.tets);
}

TEST(Tetrahedralize, TwoAtOnce) {
  const Mesh mesh = icosphere(10, 3);
  const TetMesh alone = tetrahedralize(mesh);
  std::vector<TetMesh> results(4);
  std::vector<std::jthread> threads;
  for (TetMesh& result : results) threads.emplace_back([&] { result = tetrahedralize(mesh); });
  threads.clear();
  for (const TetMesh& result : results) EXPECT_EQ(result.tets, alone.tets);
}

TEST(Tetrahedralize, BadSurfacesAreRefusedAndNothingCrashes) {
  expect_refused({}, "encloses nothing");
  expect_refused(without_triangle(cube(10), 3), "open");
  expect_refused(flipped(cube(10)), "inside out");
  expect_refused(joined(cube(10), cube(10, {10, 0, 0})), "not manifold");
  expect_refused(joined(cube(10), cube(10, {5, 5, 5})), "");  // cuts itself: TetGen crashes
  expect_refused(joined(icosphere(10, 3), icosphere(10, 3, {1, 2, 3})), "");
  Mesh flat = cube(10);
  for (Vec3f& v : flat.vertices) v.z = 0;
  expect_refused(flat, "");
  Mesh not_a_number = cube(10);
  not_a_number.vertices[3].x = std::numeric_limits<float>::quiet_NaN();
  expect_refused(not_a_number, "");
}

TEST(Tetrahedralize, GarbageNeverCrashesTheCaller) {
  Random random(7, "garbage");
  for (int round = 0; round < 8; ++round) {
    Mesh mesh = icosphere(10, 2);
    const auto wild = [&] { return static_cast<float>(40 * random.uniform() - 20); };
    for (int k = 0; k <= round; ++k) mesh.vertices[random.below(mesh.vertices.size())] = {wild(), wild(), wild()};
    try {
      const TetMesh tets = tetrahedralize(mesh, {.cpu_limit_s = 1});
      EXPECT_NEAR(volume_mm3(tets), signed_volume(mesh), 1e-3 * signed_volume(mesh));  // it may happen to be sound
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::SolverFailed);
    }
  }
}

TEST(Tetrahedralize, LimitsOfTheChildHold) {
  expect_refused(icosphere(10, 4), "", {.memory_limit_mb = 8});
  const auto start = std::chrono::steady_clock::now();
  expect_refused(icosphere(10, 3), "processor time", {.max_volume_mm3 = 1e-5, .cpu_limit_s = 1});
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Tetrahedralize, CancelEndsTheChildWithinASecond) {
  const Context context;
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    context.cancel();
  });
  const auto start = std::chrono::steady_clock::now();
  try {
    static_cast<void>(tetrahedralize(icosphere(10, 3), {.max_volume_mm3 = 1e-5}, context));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Cancelled);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(1300));
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);  // and leaves no child behind
}

TEST(Tetrahedralize, ParametersOutOfRangeAreRefused) {
  for (const TetrahedralizeParams& bad :
       {TetrahedralizeParams{.radius_edge = 1}, TetrahedralizeParams{.max_volume_mm3 = -1},
        TetrahedralizeParams{.max_volume_mm3 = std::numeric_limits<double>::quiet_NaN()},
        TetrahedralizeParams{.cpu_limit_s = 0}}) {
    try {
      static_cast<void>(tetrahedralize(cube(1), bad));
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadRecipe);
    }
  }
}

/// Names another program as TetGen for the length of a test.
class Impostor {
 public:
  explicit Impostor(const std::string& script) {
    const auto path = folder_ / "tetgen";
    std::ofstream(path) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    setenv("FIBROLITE_TETGEN", path.c_str(), 1);
  }
  ~Impostor() { unsetenv("FIBROLITE_TETGEN"); }
  Impostor(const Impostor&) = delete;
  Impostor& operator=(const Impostor&) = delete;

 private:
  TempDir folder_;
};

TEST(TetgenProgram, AnAnswerThatIsNoneIsRefused) {
  const Mesh mesh =
      icosphere(10, 5);  // more than a socket holds, so a child that does not read would block a careless parent
  const auto answer = [&](const std::string& script, const std::string& what) {
    const Impostor impostor(script);
    expect_refused(mesh, what);
  };
  answer("exit 0", "no mesh");
  answer("exit 3", "exit code 3");
  answer("kill -SEGV $$", "crashed");
  answer("cat > /dev/null; echo hello", "no mesh");
  answer("cat > /dev/null; printf 'FBLTTET1'; head -c 16 /dev/zero", "no inside");
  answer("cat > /dev/null; printf 'FBLTTET1'; head -c 16 /dev/zero | tr '\\0' '\\377'; head -c 99 /dev/zero",
         "cut off");
  // Four nodes at the origin, one tetrahedron of node 0.
  answer(
      "cat > /dev/null; printf 'FBLTTET1\\004\\0\\0\\0\\0\\0\\0\\0\\001\\0\\0\\0\\0\\0\\0\\0'; head -c 112 /dev/zero",
      "do not fit together");
}

TEST(TetgenProgram, WritingToAChildThatLeftRaisesNoSignal) {
  struct sigaction before {};
  sigaction(SIGPIPE, nullptr, &before);
  ASSERT_EQ(before.sa_handler, SIG_DFL);  // a SIGPIPE would end this test program
  const Impostor impostor("exec 0<&-; sleep 0.2; exit 5");
  expect_refused(icosphere(10, 5), "exit code 5");
}

TEST(TetgenProgram, IsFoundBesideTheProgramOrWhereItWasNamed) {
  EXPECT_EQ(tetgen_program().filename(), "fibrolite-tetgen");
  {
    const Impostor impostor("exit 0");
    EXPECT_EQ(tetgen_program().filename(), "tetgen");
  }
  setenv("FIBROLITE_TETGEN", "/nowhere/at/all", 1);  // a name that leads nowhere is passed over
  EXPECT_EQ(tetgen_program().filename(), "fibrolite-tetgen");
  unsetenv("FIBROLITE_TETGEN");
}

Proxy proxy_of(const Shape& shape, const Box3d& box, double voxel_mm) {
  Proxy proxy;
  proxy.solid = realize(shape, box, Grid{.voxel_mm = voxel_mm});
  proxy.surface = surface(proxy.solid);
  return proxy;
}

TEST(Extract, HalfACapsule) {
  const Proxy proxy = proxy_of(capsule({0, 0, -20}, {0, 0, 20}, 8), Box3d{{-10, -10, -30}, {10, 10, 30}}, 0.7);
  const TetMesh half = extract(proxy, half_space({0, 0, 3}, {0, 0, 1}), {.max_surface_triangles = 1500});
  const double volume = std::numbers::pi * 64 * (23 + 16.0 / 3);
  EXPECT_NEAR(volume_mm3(half), volume, 0.01 * volume);
  EXPECT_LE(boundary(half).size(), 1500U);
  EXPECT_GT(boundary(half).size(), 1000U);
  for (const Vec3d& p : half.nodes) EXPECT_LT(p.z, 3.5);
}

TEST(Extract, StaysWithinItsBound) {
  const Shape body = smooth_unite(sphere({0, 0, 0}, 10), capsule({0, 0, 0}, {20, 5, 0}, 4), 3);
  const Proxy proxy = proxy_of(body, Box3d{{-12, -12, -12}, {26, 12, 12}}, 0.6);
  const TetMesh mesh = extract(proxy, everything(), {.max_surface_triangles = 1200, .max_distance_vox = 0.5});
  for (const TetFace& face : boundary(mesh)) {
    for (const std::uint32_t node : face.nodes) {
      EXPECT_LT(std::abs(static_cast<double>(body(mesh.nodes[node]))), 0.6 * 0.5 + 0.1);
    }
  }
}

TEST(Extract, IslandsGoCavitiesStay) {
  const Shape hollow = subtract(cuboid({{-10, -10, -10}, {10, 10, 10}}), sphere({0, 0, 0}, 6));
  const Shape island = sphere({20, 0, 0}, 3);
  const Proxy proxy = proxy_of(unite({hollow, island}), Box3d{{-12, -12, -12}, {26, 12, 12}}, 0.8);
  const TetMesh mesh = extract(proxy, everything(), {.max_surface_triangles = 3000});
  const double volume = 8000 - 4.0 / 3 * std::numbers::pi * 216;
  EXPECT_NEAR(volume_mm3(mesh), volume, 0.02 * volume);
  for (const Vec3d& p : mesh.nodes) EXPECT_LT(p.x, 12);
}

/// What presses on a patch of a face acts on its triangles: a face that is flat to the last bit keeps its share of
/// them, however often the body's edges are bent.
TEST(Extract, FlatFacesKeepTheirTriangles) {
  constexpr double side = 40, turned = 4e-4;
  constexpr int most = 3000;
  const Shape body = placed(offset(cuboid({{-17, -17, -17}, {17, 17, 17}}), 3), frame_along({}, {turned, -turned, 1}));
  const Proxy proxy = proxy_of(body, Box3d{{-24, -24, -24}, {24, 24, 24}}, 0.8);
  const TetMesh mesh = extract(proxy, everything(), {.max_surface_triangles = most});
  double longest = 0;
  for (const TetFace& face : boundary(mesh))
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, norm(mesh.nodes[face.nodes[k]] - mesh.nodes[face.nodes[(k + 1) % 3]]));
  // Were all of them alike and equilateral.
  const double even = std::sqrt(4 / std::sqrt(3.0) * 6 * side * side / most);
  EXPECT_LT(longest, 5 * even);
}

TEST(Extract, NothingToExtractIsSaid) {
  const Proxy proxy = proxy_of(sphere({0, 0, 0}, 8), Box3d{{-10, -10, -10}, {10, 10, 10}}, 0.8);
  try {
    static_cast<void>(extract(proxy, half_space({50, 0, 0}, {-1, 0, 0})));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::SolverFailed);
    EXPECT_THAT(error.what(), HasSubstr("no volume"));
  }
}

}  // namespace
}  // namespace fibrolite
