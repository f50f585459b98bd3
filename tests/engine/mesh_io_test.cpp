// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "mesh_checks.h"
#include "models.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;
using namespace testing;
using ::testing::HasSubstr;

void put(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class T>
std::string bytes_of(T value, bool swap = false) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return {bytes.begin(), bytes.end()};
}

// Reads `text` as a file of that ending and returns the error's words.
std::string complaint(const std::string& ending, const std::string& text, Code code = Code::BadInput) {
  const TempDir dir;
  const fs::path path = dir / ("model" + ending);
  put(path, text);
  try {
    (void)read_mesh(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    EXPECT_THAT(error.what(), ::testing::Not(HasSubstr("\n")));
    return error.what();
  }
  ADD_FAILURE() << "read without an error";
  return "";
}
MeshFile parse(const std::string& ending, const std::string& text) {
  const TempDir dir;
  put(dir / ("model" + ending), text);
  return read_mesh(dir / ("model" + ending));
}

// Coordinates that need every digit, and none.
Mesh awkward() {
  Mesh mesh = icosphere(1, 2);
  Random random(3, "mesh_io_test");
  for (Vec3f& p : mesh.vertices)
    for (float* x : {&p.x, &p.y, &p.z})
      *x = std::ldexp(static_cast<float>(random.uniform() - 0.5), static_cast<int>(random.below(60)) - 30);
  mesh.vertices[0] = {0.1F, 1e-7F, -1234.56789F};
  mesh.vertices[1] = {-0.0F, 16777215.0F, 3e-39F};
  return mesh;
}

class EveryFormat : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(MeshIo, EveryFormat, ::testing::ValuesIn(writable_mesh_endings()),
                         [](const auto& test) { return "x" + test.param.substr(1); });

TEST_P(EveryFormat, reads_back_the_same_floats) {
  const TempDir dir;
  const Mesh mesh = awkward();
  write_mesh(dir / ("m" + GetParam()), mesh);
  const MeshFile file = read_mesh(dir / ("m" + GetParam()));
  ASSERT_EQ(file.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(file.unit_mm, 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(file.mesh.vertices[file.mesh.triangles[t][i]], mesh.vertices[mesh.triangles[t][i]]) << t;
}

TEST_P(EveryFormat, same_bytes_on_one_and_two_threads) {
  const TempDir dir;
  const Mesh mesh = torus_mesh(30, 10, 300, 150);  // several chunks
  const auto write = [&](const std::string& name, std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    write_mesh(dir / (name + GetParam()), mesh);
    return content(dir / (name + GetParam()));
  };
  EXPECT_EQ(write("one", 1), write("two", 2));
}

TEST_P(EveryFormat, a_cancelled_write_leaves_nothing) {
  const TempDir dir;
  const Context context;
  context.cancel();
  EXPECT_THROW(write_mesh(dir / ("m" + GetParam()), torus_mesh(3, 1, 30, 30), context), Error);
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

TEST_P(EveryFormat, progress_ends_at_one) {
  const TempDir dir;
  double last = 0;
  const Context context([&](double fraction, std::string_view) { last = fraction; }, {});
  write_mesh(dir / ("m" + GetParam()), cube(1), context);
  EXPECT_EQ(last, 1);
}

TEST_P(EveryFormat, empty_and_missing_files_and_noise) {
  EXPECT_THAT(complaint(GetParam(), ""), HasSubstr("empty"));
  EXPECT_NE(complaint(GetParam(), "just some words\nand more of them\n"), "");
  const TempDir dir;
  try {
    (void)read_mesh(dir / ("none" + GetParam()));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::BadInput);
    EXPECT_THAT(error.what(), HasSubstr("No such file"));
  }
}

// Cut short, with bytes changed, with digits changed: an Error or a mesh, never a crash, and never more than the file
// can hold.
TEST_P(EveryFormat, survives_damage) {
  const TempDir dir;
  write_mesh(dir / ("m" + GetParam()), icosphere(1, 2));
  const std::string good = content(dir / ("m" + GetParam()));
  Random random(4, GetParam());
  const fs::path path = dir / ("damaged" + GetParam());
  int refused = 0;
  constexpr int rounds = 300;
  for (int round = 0; round < rounds; ++round) {
    std::string bad = good;
    if (round % 3 == 0) bad.resize(random.below(bad.size()));
    for (std::uint64_t k = round % 3, n = 1 + random.below(4); k > 0 && n > 0; --n)
      bad[random.below(round % 2 == 0 ? bad.size() : std::min<std::size_t>(bad.size(), 400))] =
          round % 3 == 1 ? static_cast<char>(random.below(256)) : static_cast<char>('0' + random.below(10));
    put(path, bad);
    try {
      const MeshFile file = read_mesh(path);
      EXPECT_LE(file.mesh.triangles.size(), 4 * bad.size());
      for (const auto& t : file.mesh.triangles)
        for (const std::uint32_t v : t) ASSERT_LT(v, file.mesh.vertices.size());
      for (const Vec3f p : file.mesh.vertices)
        ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    } catch (const Error& error) {
      ++refused;
      EXPECT_TRUE(error.code() == Code::BadInput || error.code() == Code::Unsupported) << error.what();
    }
  }
  EXPECT_GT(refused, rounds / 4);
}

TEST(MeshIo, unknown_endings_are_named) {
  EXPECT_THAT(complaint(".step", "x", Code::Unsupported), HasSubstr(".step"));
  EXPECT_THROW(write_mesh("model.xyz", cube(1)), Error);
  EXPECT_EQ(readable_mesh_endings(), (std::vector<std::string>{".stl", ".obj", ".ply", ".off", ".3mf"}));
}

TEST(MeshIo, endings_may_be_capital) {
  const TempDir dir;
  write_mesh(dir / "M.STL", cube(1));
  EXPECT_EQ(read_mesh(dir / "M.STL").mesh.triangles.size(), 12U);
}

TEST(MeshIo, writing_nothing_is_an_error) {
  const TempDir dir;
  EXPECT_THROW(write_mesh(dir / "m.stl", Mesh{}), Error);
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

// ---- STL

const std::string ascii_triangle =
    "solid a name with facet in it\n facet normal nan 0 0\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n   vertex "
    "+0 1.5 -2E-1\n  endloop\n endfacet\nendsolid\n";

TEST(Stl, binary_layout) {
  const TempDir dir;
  write_mesh(dir / "m.stl", cube(2));
  const std::string bytes = content(dir / "m.stl");
  ASSERT_EQ(bytes.size(), 84U + 12 * 50);
  EXPECT_NE(bytes.substr(0, 5), "solid");
  EXPECT_EQ(bytes.substr(80, 4), bytes_of(std::uint32_t{12}));
  EXPECT_EQ(bytes.substr(84, 12), bytes_of(0.0F) + bytes_of(0.0F) + bytes_of(-1.0F));  // first triangle: bottom
}

TEST(Stl, ascii) {
  const MeshFile file = parse(".stl", ascii_triangle + ascii_triangle);
  ASSERT_EQ(file.mesh.triangles.size(), 2U);
  EXPECT_EQ(file.mesh.vertices[file.mesh.triangles[1][2]], (Vec3f{0, 1.5F, -0.2F}));
}

TEST(Stl, a_binary_file_may_begin_with_solid) {
  const TempDir dir;
  write_mesh(dir / "m.stl", cube(2));
  std::string bytes = content(dir / "m.stl");
  bytes.replace(0, 9, "solid abc");
  EXPECT_EQ(parse(".stl", bytes).mesh.triangles.size(), 12U);
  EXPECT_THAT(complaint(".stl", bytes.substr(0, 300)), HasSubstr("12 triangles in 684 bytes, the file has 300"));
  EXPECT_THAT(parse(".stl", bytes + "xx").notes, ::testing::ElementsAre("2 bytes after the last triangle ignored"));
}

TEST(Stl, bad_input_names_the_place) {
  EXPECT_THAT(complaint(".stl", "hello, this is a letter\n"), HasSubstr("text file, but not an STL"));
  EXPECT_THAT(complaint(".stl", ascii_triangle.substr(0, ascii_triangle.size() - 10)), HasSubstr("endsolid"));
  EXPECT_THAT(complaint(".stl", ascii_triangle.substr(0, 120)), HasSubstr("line 6"));
  std::string word = ascii_triangle;
  word.replace(word.find("1e0"), 3, "1,0");
  EXPECT_THAT(complaint(".stl", word), ::testing::AllOf(HasSubstr("line 5"), HasSubstr("'1,0'")));
  for (const char* bad : {"nan", "inf", "-NaN", "1e39", "1e999"}) {
    std::string text = ascii_triangle;
    text.replace(text.find("1e0"), 3, bad);
    EXPECT_THAT(complaint(".stl", text),
                ::testing::AllOf(HasSubstr("line 5"), HasSubstr("NaN, infinite or too large")));
  }
  EXPECT_THAT(complaint(".stl", "solid nothing\nendsolid nothing\n"), HasSubstr("no triangles"));
  EXPECT_THAT(complaint(".stl", std::string(80, '\0') + bytes_of(std::uint32_t{0})), HasSubstr("no triangles"));
  EXPECT_THAT(complaint(".stl", std::string("\x01\x02", 2)), HasSubstr("too short"));
}

TEST(Stl, binary_nan_names_the_triangle) {
  const TempDir dir;
  write_mesh(dir / "m.stl", cube(2));
  std::string bytes = content(dir / "m.stl");
  bytes.replace(84 + 7 * 50 + 12, 4, bytes_of(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_THAT(complaint(".stl", bytes), HasSubstr("triangle 8 of 12"));
}

// ---- OBJ

TEST(Obj, faces_in_every_form) {
  const MeshFile file = parse(".obj",
                              "# comment\nmtllib x.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\r\nv 0 1 0\n"
                              "vt 0 0\nvn 0 0 1\nf 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 3/1/1\n"
                              "f -4 -3 -2\nf 1 2 \\\n 3 4\nl 1 2\nf 1 2\nf 4 5 6\nv 2 2 2\nv 3 3 4\n");
  const std::vector<Mesh::Triangle> expected{{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2},
                                             {0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {3, 4, 5}};
  EXPECT_EQ(file.mesh.triangles, expected);
  EXPECT_THAT(file.notes, ::testing::ElementsAre("1 polygons with fewer than 3 corners left out"));
}

TEST(Obj, bad_input_names_the_line) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(complaint(".obj", corners + "f 1 2 4\n"), ::testing::AllOf(HasSubstr("line 4"), HasSubstr("index 4")));
  EXPECT_THAT(complaint(".obj", corners + "f 1 2 0\n"), HasSubstr("line 4"));
  EXPECT_THAT(complaint(".obj", corners + "f -1 -2 -4\n"), HasSubstr("index -4"));
  EXPECT_THAT(complaint(".obj", corners + "f 1 2 99999999999999\n"), HasSubstr("line 4"));
  EXPECT_THAT(complaint(".obj", corners + "f 1 2 x\n"), HasSubstr("'x'"));
  EXPECT_THAT(complaint(".obj", "v 0 0 nan\n"), HasSubstr("line 1"));
  EXPECT_THAT(complaint(".obj", corners), HasSubstr("no triangles"));
}

// ---- polygons

// A flat polygon keeps its area in triangles that all face up, wherever its first corner is.
TEST(Polygons, concave_ones_stay_inside) {
  const std::vector<std::array<int, 2>> comb{{0, 0}, {6, 0}, {6, 4}, {5, 4}, {5, 1}, {4, 1},
                                             {4, 4}, {2, 4}, {2, 1}, {1, 1}, {1, 4}, {0, 4}};
  const double truth = 6 * 1 + 1 * 3 + 2 * 3 + 1 * 3;
  for (std::size_t first = 0; first < comb.size(); ++first) {
    std::string text = "OFF\n12 1 0\n";
    for (std::size_t i = 0; i < comb.size(); ++i) {
      const auto& p = comb[(first + i) % comb.size()];
      text += std::to_string(p[0]) + " " + std::to_string(p[1]) + " 0\n";
    }
    const Mesh mesh = parse(".off", text + "12 0 1 2 3 4 5 6 7 8 9 10 11\n").mesh;
    EXPECT_EQ(mesh.triangles.size(), 10U);
    EXPECT_DOUBLE_EQ(area(mesh), truth) << "first corner " << first;
  }
}

// ---- PLY

std::string ply(const std::string& format, const std::string& body) {
  return "ply\nformat " + format +
         " 1.0\ncomment made by a test\nelement vertex 4\nproperty double x\nproperty uchar quality\nproperty float y\n"
         "property list uchar short extra\nproperty float z\nelement junk 1\nproperty int a\nelement face 2\n"
         "property uchar red\nproperty list uchar int vertex_indices\nproperty uchar green\nproperty uchar "
         "blue\nend_header\n" +
         body;
}
std::string ply_body(bool swap) {
  std::string body;
  for (int i = 0; i < 4; ++i) {
    body += bytes_of(i * 0.5, swap) + bytes_of(std::uint8_t{7}) + bytes_of(static_cast<float>(i * i), swap);
    body += bytes_of(std::uint8_t{2}) + bytes_of(std::int16_t{300}, swap) + bytes_of(std::int16_t{-1}, swap);
    body += bytes_of(static_cast<float>(-i), swap);
  }
  body += bytes_of(std::int32_t{5}, swap);
  for (const int n : {3, 4}) {
    body += bytes_of(std::uint8_t{255}) + bytes_of(static_cast<std::uint8_t>(n));
    for (int i = 0; i < n; ++i) body += bytes_of(std::int32_t{i}, swap);
    body += bytes_of(std::uint8_t{10}) + bytes_of(static_cast<std::uint8_t>(n));
  }
  return body;
}

TEST(Ply, three_encodings_with_strange_properties) {
  const std::string text =
      "0 7 0 2 300 -1 0\n0.5 7 1 2 300 -1 -1\n1 7 4 2 300 -1 -2\n1.5 7 9 2 300 -1 -3\n5\n255 3 0 1 2 10 3\n255 4 0 1 2 "
      "3 10 "
      "4\n";
  for (const auto& [format, body] : {std::pair{"ascii", text}, std::pair{"binary_little_endian", ply_body(false)},
                                     std::pair{"binary_big_endian", ply_body(true)}}) {
    const Mesh mesh = parse(".ply", ply(format, body)).mesh;
    ASSERT_EQ(mesh.vertices.size(), 4U) << format;
    EXPECT_EQ(mesh.vertices[3], (Vec3f{1.5F, 9, -3})) << format;
    ASSERT_EQ(mesh.triangles.size(), 3U) << format;
    EXPECT_EQ(mesh.triangles[0], (Mesh::Triangle{0, 1, 2})) << format;
    EXPECT_EQ(mesh.triangle_colors, (std::vector<Rgb>{{255, 10, 3}, {255, 10, 4}, {255, 10, 4}})) << format;
  }
}

TEST(Ply, colours_come_back) {
  const TempDir dir;
  Mesh mesh = cube(1);
  for (std::size_t t = 0; t < 12; ++t) mesh.triangle_colors.push_back({static_cast<std::uint8_t>(20 * t), 1, 255});
  write_mesh(dir / "m.ply", mesh);
  EXPECT_EQ(read_mesh(dir / "m.ply").mesh.triangle_colors, mesh.triangle_colors);
}

TEST(Ply, bad_input_names_the_place) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_THAT(complaint(".ply", head + faces + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
              ::testing::AllOf(HasSubstr("line 13"), HasSubstr("index 3")));
  EXPECT_THAT(complaint(".ply", head + faces + "0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"), HasSubstr("line 11"));
  EXPECT_THAT(complaint(".ply", head + faces + "0 0 0\n1 0 0\n"), HasSubstr("truncated"));
  EXPECT_THAT(complaint(".ply", head + "end_header\n0 0 0\n1 0 0\n0 1 0\n"), HasSubstr("point cloud"));
  EXPECT_THAT(complaint(".ply",
                        "ply\nformat ascii 1.0\nelement vertex 900000000000\nproperty float x\nproperty float y\n"
                        "property float z\n" +
                            faces + "0 0 0\n"),
              HasSubstr("900000000000"));
  EXPECT_THAT(complaint(".ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty quux x\n"), HasSubstr("'quux'"));
  const std::string binary = ply("binary_little_endian", ply_body(false));
  EXPECT_THAT(complaint(".ply", binary.substr(0, binary.size() - 3)), HasSubstr("byte"));
}

// ---- OFF

TEST(Off, comments_colours_and_header_on_one_line) {
  const MeshFile file =
      parse(".off",
            "# a comment\nCOFF 4 2 0 # counts\n0 0 0 255 0 0 255\n1 0 0 0 0 0 255\n\n# more\n0 1 0 1 1 1 "
            "1\n0 0 1 9 9 9 9\n3 0 1 2 0.5 0.5 0.5\n3 0 1 3\n");
  EXPECT_EQ(file.mesh.triangles, (std::vector<Mesh::Triangle>{{0, 1, 2}, {0, 1, 3}}));
  EXPECT_EQ(file.mesh.vertices[3], (Vec3f{0, 0, 1}));
}

TEST(Off, bad_input_names_the_line) {
  EXPECT_THAT(complaint(".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), HasSubstr("line 6"));
  EXPECT_THAT(complaint(".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"), HasSubstr("after 2 of 3 vertices"));
  EXPECT_THAT(complaint(".off", "OFF\n3000000 1 0\n0 0 0\n1 0 0\n"), HasSubstr("3000000"));
  EXPECT_THAT(complaint(".off", "OFF BINARY\n3 1 0\n", Code::Unsupported), HasSubstr("binary"));
  EXPECT_THAT(complaint(".off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"), HasSubstr("no triangles"));
}

// ---- 3MF

TEST(ThreeMf, has_no_random_bytes) {
  const TempDir dir;
  write_mesh(dir / "a.3mf", cube(1));
  write_mesh(dir / "b.3mf", cube(1));
  EXPECT_EQ(content(dir / "a.3mf"), content(dir / "b.3mf"));
}

TEST(ThreeMf, colours_do_not_disturb_the_geometry) {
  const TempDir dir;
  Mesh mesh = cube(1);
  for (std::size_t t = 0; t < 12; ++t) mesh.triangle_colors.push_back(t % 2 == 0 ? Rgb{255, 0, 0} : Rgb{0, 128, 255});
  write_mesh(dir / "m.3mf", mesh);
  EXPECT_EQ(read_mesh(dir / "m.3mf").mesh.triangles, mesh.triangles);
}

// Zips a model with the system's tool, so that reader and writer do not share their mistakes.
MeshFile read_3mf_text(const std::string& model) {
  const TempDir dir;
  write_mesh(dir / "m.3mf", cube(1));
  fs::create_directory(dir / "3D");
  put(dir / "3D/3dmodel.model", model);
  const std::string command = "cd '" + dir.path().string() + "' && zip -q m.3mf 3D/3dmodel.model";
  if (std::system(command.c_str()) != 0) throw std::runtime_error("zip failed");
  return read_mesh(dir / "m.3mf");
}

TEST(ThreeMf, units_transforms_components_and_mirrors) {
  if (std::system("command -v zip > /dev/null") != 0) GTEST_SKIP() << "the program zip is not installed";
  const std::string tetrahedron =
      "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/><vertex x='0' y='1' z='0'/><vertex x='0' "
      "y='0' "
      "z='1'/></vertices><triangles><triangle v1='0' v2='2' v3='1'/><triangle v1='0' v2='1' v3='3'/><triangle v1='0' "
      "v2='3' "
      "v3='2'/><triangle v1='1' v2='2' v3='3'/></triangles></mesh>";
  // The group holds the tetrahedron twice: as it is, and mirrored in x. The group is scaled by 2 and moved by (10, 20,
  // 30).
  const MeshFile file = read_3mf_text(
      "<?xml version='1.0' encoding='UTF-8'?><model unit='inch' xml:lang='en-US' "
      "xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'><resources><object id='1' type='model'>" +
      tetrahedron +
      "</object><object id='2' type='model'><components><component objectid='1'/><component objectid='1' "
      "transform='-1 0 0 0 1 0 0 0 1 0 0 0'/></components></object><object id='3' type='support'>" +
      tetrahedron +
      "</object></resources><build><item objectid='2' transform='2 0 0 0 2 0 0 0 2 10 20 30'/><item "
      "objectid='3'/></build></model>");
  EXPECT_EQ(file.unit_mm, 25.4);
  EXPECT_EQ(file.mesh.triangles.size(), 8U);
  EXPECT_EQ(bounds(file.mesh).min, (Vec3d{8, 20, 30}));
  EXPECT_EQ(bounds(file.mesh).max, (Vec3d{12, 22, 32}));
  EXPECT_NEAR(signed_volume(file.mesh), 2 * 8.0 / 6, 1e-12);  // the mirrored one is outward too
  EXPECT_THAT(file.notes, ::testing::ElementsAre("1 support objects left out"));
}

TEST(MeshIo, shared_models_are_read) {
  struct Known {
    const char* file;
    std::size_t triangles;
  };
  for (const Known& known : {Known{"horse.ply", 96966}, Known{"fertility.off", 9000}, Known{"monkey.obj", 968}}) {
    const auto path = shared_model(known.file);
    if (!path) GTEST_SKIP() << "the shared models are not here";
    EXPECT_EQ(read_mesh(*path).mesh.triangles.size(), known.triangles);
  }
}

TEST(MeshIo, an_independent_slicer_finds_no_fault) {
  if (std::system("command -v prusa-slicer > /dev/null") != 0) GTEST_SKIP() << "prusa-slicer is not installed";
  const TempDir dir;
  for (const char* name : {"m.stl", "m.3mf", "m.obj"}) {
    write_mesh(dir / name, torus_mesh(30, 10, 60, 30));
    const std::string info = (dir / "info.txt").string();
    ASSERT_EQ(std::system(("prusa-slicer --info '" + (dir / name).string() + "' > '" + info + "' 2>&1").c_str()), 0)
        << name;
    EXPECT_THAT(content(info), HasSubstr("manifold = yes")) << name;
    EXPECT_THAT(content(info), HasSubstr("number_of_facets = 3600")) << name;
    EXPECT_THAT(content(info), ::testing::Not(HasSubstr("facets_reversed"))) << name;
  }
}

}  // namespace
}  // namespace fibrolite
