// SPDX-License-Identifier: GPL-3.0-or-later
// Slice stacks, read back by lib3mf.
#include <Model/COM/NMR_DLLInterfaces.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "archive.h"
#include "fibrolite/contours.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/slice_io.h"
#include "run_program.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;

class Object {
 public:
  Object() = default;
  ~Object() {
    if (object_ != nullptr) NMR::lib3mf_release(object_);
  }
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  NMR::PLib3MFBase** put() { return &object_; }
  [[nodiscard]] NMR::PLib3MFBase* get() const { return object_; }

 private:
  NMR::PLib3MFBase* object_ = nullptr;
};
void must(LIB3MFRESULT result) { ASSERT_EQ(result, 0); }

struct ReadSlice {
  float top_mm = 0;
  std::vector<std::vector<Vec2d>> polygons;
};
ReadSlice read_slice(const Object& slice) {
  ReadSlice read;
  must(NMR::lib3mf_slice_gettopz(slice.get(), &read.top_mm));
  DWORD vertices = 0, polygons = 0;
  must(NMR::lib3mf_slice_getvertexcount(slice.get(), &vertices));
  must(NMR::lib3mf_slice_getpolygoncount(slice.get(), &polygons));
  std::vector<NMR::MODELSLICEVERTEX> points(vertices);
  if (vertices > 0) must(NMR::lib3mf_slice_getvertices(slice.get(), points.data(), vertices));
  for (DWORD p = 0; p < polygons; ++p) {
    DWORD count = 0;
    must(NMR::lib3mf_slice_getpolygonindexcount(slice.get(), p, &count));
    std::vector<DWORD> indices(count);
    must(NMR::lib3mf_slice_getpolygonindices(slice.get(), p, indices.data(), count));
    EXPECT_GE(count, 4U);
    EXPECT_EQ(indices.front(), indices.back()) << "an open polygon";
    std::vector<Vec2d>& polygon = read.polygons.emplace_back();
    for (const DWORD i : indices)
      polygon.push_back({double{points.at(i).m_fPosition[0]}, double{points.at(i).m_fPosition[1]}});
  }
  return read;
}
/// The stack of the one object on the build plate.
std::vector<ReadSlice> read_stack(const std::filesystem::path& file) {
  std::string bytes = content(file);
  Object model, reader, items, item, object, stack;
  must(NMR::lib3mf_createmodel(model.put()));
  must(NMR::lib3mf_model_queryreader(model.get(), "3mf", reader.put()));
  must(NMR::lib3mf_reader_readfrombuffer(reader.get(), reinterpret_cast<BYTE*>(bytes.data()), bytes.size()));
  DWORD warnings = 0;
  must(NMR::lib3mf_reader_getwarningcount(reader.get(), &warnings));
  EXPECT_EQ(warnings, 0U);
  must(NMR::lib3mf_model_getbuilditems(model.get(), items.put()));
  BOOL has = 0;
  must(NMR::lib3mf_builditemiterator_movenext(items.get(), &has));
  must(NMR::lib3mf_builditemiterator_getcurrent(items.get(), item.put()));
  must(NMR::lib3mf_builditem_getobjectresource(item.get(), object.put()));
  DWORD id = 0, count = 0;
  must(NMR::lib3mf_meshobject_getslicestackid(object.get(), &id));
  must(NMR::lib3mf_model_getslicestackById(model.get(), id, stack.put()));
  must(NMR::lib3mf_slicestack_getslicecount(stack.get(), &count));
  std::vector<ReadSlice> slices;
  for (DWORD n = 0; n < count; ++n) {
    Object slice;
    must(NMR::lib3mf_slicestack_getslice(stack.get(), n, slice.put()));
    slices.push_back(read_slice(slice));
  }
  return slices;
}

double area(const std::vector<Vec2d>& closed) {
  double twice = 0;
  for (std::size_t i = 0; i + 1 < closed.size(); ++i)
    twice += closed[i].x * closed[i + 1].y - closed[i].y * closed[i + 1].x;
  return 0.5 * twice;
}

/// A tube with a pin in it up to 2 mm, nothing from there to 3 mm, a bar above.
Shape part() {
  return unite({subtract(cylinder({0, 0, 0}, {0, 0, 2}, 5), cylinder({0, 0, -1}, {0, 0, 3}, 4)),
                cylinder({1, 1, 0}, {1, 1, 2}, 1), cuboid({{-3, -3, 3}, {3, 4, 4}})});
}

TEST(Slice3mf, Lib3mfReadsEveryContourBack) {
  const TempDir folder;
  const SliceJob job{
      .shape = part(), .plates = {{"", slice_grid({}, {{-6, -6, 0}, {9, 6, 4}}, {0.1, 0.1}, 0.25)}}, .name = "tube"};
  const SliceGrid& grid = job.plates[0].grid;
  const auto done = write_slices(folder / "a.3mf", SliceFormat::ThreeMf, job);
  const std::vector<ReadSlice> stack = read_stack(folder / "a.3mf");
  ASSERT_EQ(stack.size(), 16U);
  constexpr double pi = std::numbers::pi;
  double volume_mm3 = 0;
  for (std::size_t n = 0; n < stack.size(); ++n) {
    EXPECT_FLOAT_EQ(stack[n].top_mm, 0.25F * static_cast<float>(n + 1));
    const std::vector<Contour> wanted = contours(job.shape, grid, static_cast<int>(n));
    ASSERT_EQ(stack[n].polygons.size(), wanted.size()) << n;
    double all = 0;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      // Places are rounded to 0.1 um: by half of that along the outline, at most 32 mm long.
      EXPECT_NEAR(area(stack[n].polygons[k]), wanted[k].area_mm2, 32 * 1e-4);
      all += area(stack[n].polygons[k]);
    }
    EXPECT_NEAR(all, done[0].area_mm2[n], 0.01);
    EXPECT_NEAR(all, n < 8 ? 10 * pi : n < 12 ? 0 : 42, 0.05);  // holes count against what is round them
    volume_mm3 += 0.25 * all;
  }
  EXPECT_NEAR(volume_mm3, 20 * pi + 42, 0.1);
  EXPECT_EQ(stack[3].polygons.size(), 3U);
  EXPECT_EQ(stack[9].polygons.size(), 0U);
}

TEST(Slice3mf, TheMeshIsABoxAboutTheLayers) {
  const TempDir folder;
  const SliceJob job{
      .shape = part(), .plates = {{"", slice_grid({}, {{-6, -6, 0}, {9, 6, 4}}, {0.1, 0.1}, 0.25)}}, .name = "tube"};
  write_slices(folder / "a.3mf", SliceFormat::ThreeMf, job);
  const Mesh mesh = read_mesh(folder / "a.3mf").mesh;
  EXPECT_EQ(mesh.triangles.size(), 12U);
  EXPECT_NEAR(signed_volume(mesh), 15 * 12 * 4, 1e-3);  // closed, and outward
  EXPECT_EQ(check(mesh).boundary_edges, 0);
  const auto entries = unzipped(content(folder / "a.3mf"));
  EXPECT_THAT(entries.at("3D/3dmodel.model"), ::testing::HasSubstr("requiredextensions=\"s\""));
  EXPECT_THAT(entries.at("3D/3dmodel.model"), ::testing::HasSubstr("s:meshresolution=\"lowres\""));
}

}  // namespace
}  // namespace fibrolite
