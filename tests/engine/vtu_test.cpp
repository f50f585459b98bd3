// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/vtu.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

#include "fibrolite/error.h"
#include "run_program.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;
using testing::TempDir;

TetMesh two_tets() {
  return ten_node({{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}, {2, 3, 4}}, {{0, 1, 2, 3}, {1, 2, 3, 4}});
}

std::vector<VtuField> node_fields(const TetMesh& mesh) {
  VtuField height{"height", 1, {}}, place{"place", 3, {}};
  for (const Vec3d p : mesh.nodes) {
    height.values.push_back(p.z);
    place.values.insert(place.values.end(), {p.x, p.y, p.z});
  }
  return {height, place};
}

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// Arrays where the XML says they are, as long as their headers say.
TEST(Vtu, raw_data_lies_where_the_header_says) {
  const TempDir folder;
  const TetMesh mesh = two_tets();
  write_vtu(folder / "a.vtu", mesh, node_fields(mesh), {{"part", 1, {0, 1}}});
  const std::string all = testing::content(folder / "a.vtu");
  const std::size_t data =
      all.find("<AppendedData encoding=\"raw\">\n_") + std::strlen("<AppendedData encoding=\"raw\">\n_");
  const auto offset = [&](const std::string& name) {
    const std::size_t element = all.find("Name=\"" + name + "\""), from = all.find("offset=\"", element) + 8;
    return data + std::stoul(all.substr(from));
  };
  EXPECT_EQ(at<std::uint64_t>(all, offset("Points")), mesh.nodes.size() * 24);
  EXPECT_EQ(at<double>(all, offset("Points") + 8 + 24 + 0), mesh.nodes[1].x);
  EXPECT_EQ(at<std::uint64_t>(all, offset("connectivity")), 80U);
  EXPECT_EQ(at<std::uint32_t>(all, offset("connectivity") + 8 + 4 * 10), mesh.tets[1][0]);
  EXPECT_EQ(at<std::int64_t>(all, offset("offsets") + 16), 20);
  EXPECT_EQ(at<std::uint8_t>(all, offset("types") + 8), 24);
  EXPECT_EQ(at<double>(all, offset("height") + 8 + 8 * 3), 4.0);
  EXPECT_EQ(at<double>(all, offset("part") + 8 + 8), 1.0);
}

/// VTK's own reader, where it is installed: cells, their volume, and the fields come back.
TEST(Vtu, opens_in_vtk) {
  const TempDir folder;
  const TetMesh mesh = two_tets();
  write_vtu(folder / "a.vtu", mesh, node_fields(mesh), {{"part", 1, {0, 1}}});
  std::ofstream(folder / "read.py") << R"(import sys
try:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError:
    sys.exit(77)
reader = vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()
point, cell = grid.GetPointData(), grid.GetCellData()
height, place = point.GetArray("height"), point.GetArray("place")
same = all(grid.GetPoint(i)[2] == height.GetValue(i) == place.GetTuple3(i)[2] for i in range(grid.GetNumberOfPoints()))
print(grid.GetNumberOfPoints(), grid.GetNumberOfCells(), grid.GetCellType(1), cell.GetArray("part").GetValue(1), same)
)";
  const testing::Finished run = testing::run_program("/usr/bin/python3", {folder / "read.py", folder / "a.vtu"});
  if (run.code == 77 || run.code == 127) GTEST_SKIP() << "VTK's Python reader is not installed";
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out, std::to_string(mesh.nodes.size()) + " 2 24 1.0 True\n");
}

TEST(Vtu, a_field_that_does_not_fit_is_refused_and_nothing_is_left) {
  const TempDir folder;
  const TetMesh mesh = two_tets();
  const auto refuses = [&](const VtuField& field) {
    EXPECT_THROW(write_vtu(folder / "a.vtu", mesh, {}, {field}), Error);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.vtu"));
  };
  refuses({"part", 1, {0}});
  refuses({"part", 2, {0, 1}});
  refuses({"part", 1, {0, std::numeric_limits<double>::quiet_NaN()}});
  try {
    write_vtu(folder / "a.vtu", mesh, {{"short", 1, {1}}}, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("short"));
  }
}

}  // namespace
}  // namespace fibrolite
