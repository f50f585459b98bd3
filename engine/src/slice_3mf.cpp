// SPDX-License-Identifier: Apache-2.0
// Source: 3MF Slice Extension 1.0.2. A slice is named by the height of its top; a polygon ends with its first vertex,
// and runs round material to the left, round a hole to the right. An object must have a mesh: here a box about all
// layers, marked as no more than that, which only a program that knows slices may take.
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "fibrolite/contours.h"
#include "slice_formats.h"
#include "threemf_package.h"
#include "zip_writer.h"

namespace fibrolite {
namespace {

/// Corner c lies at the far end of x, y, z where bit 0, 1, 2 of c is set.
std::string box_mesh(const SliceGrid& grid) {
  const std::array<std::string, 3> far{number(grid.width * grid.pixel_mm.x), number(grid.height * grid.pixel_mm.y),
                                       number(grid.layers * grid.layer_mm)};
  std::string text = "<mesh>\n<vertices>\n";
  for (unsigned corner = 0; corner < 8; ++corner) {
    text += "<vertex";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      text.append(" ").append(1, "xyz"[axis]).append("=\"");
      text.append((corner >> axis & 1U) != 0 ? far[axis] : "0").append("\"");
    }
    text += "/>\n";
  }
  text += "</vertices>\n<triangles>\n";
  for (const char* corners : {"021", "123", "456", "576", "014", "154", "263", "367", "042", "246", "135", "375"}) {
    text.append("<triangle v1=\"").append(1, corners[0]).append("\" v2=\"").append(1, corners[1]);
    text.append("\" v3=\"").append(1, corners[2]).append("\"/>\n");
  }
  return text + "</triangles>\n</mesh>\n";
}

class SliceStack final : public LayerFormat {
 public:
  SliceStack(const SliceJob& job, OutputFile& file) : LayerFormat(job), zip_(file) {}

  [[nodiscard]] EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const override {
    std::string vertices, polygons;
    std::size_t count = 0;
    double area_mm2 = 0;
    for (const Contour& outline : contours(shape, plate.grid, layer)) {
      area_mm2 += outline.area_mm2;
      const std::vector<UnitPoint> points = in_units(outline);
      if (points.empty()) continue;
      for (const UnitPoint& p : points) {
        vertices += "<s:vertex x=\"";
        append_mm(vertices, p.x);
        vertices += "\" y=\"";
        append_mm(vertices, p.y);
        vertices += "\"/>\n";
      }
      polygons += "<s:polygon startv=\"";
      append_integer(polygons, static_cast<long long>(count));
      polygons += "\">\n";
      for (std::size_t k = 1; k <= points.size(); ++k) {
        polygons += "<s:segment v2=\"";
        append_integer(polygons, static_cast<long long>(count + k % points.size()));
        polygons += "\"/>\n";
      }
      polygons += "</s:polygon>\n";
      count += points.size();
    }
    std::string text = "<s:slice ztop=\"";
    text += number((layer + 1) * plate.grid.layer_mm);
    if (count == 0) {
      text += "\"/>\n";
    } else {
      text += "\">\n<s:vertices>\n";
      text.append(vertices).append("</s:vertices>\n").append(polygons).append("</s:slice>\n");
    }
    return {layer, {}, deflate_piece(text), area_mm2};
  }
  void start() override {
    begin_3mf(zip_);
    zip_.open(model_part_3mf);
    zip_.append(deflate_piece(R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" requiredextensions="s" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07">
<metadata name="Application">Fibrolite</metadata>
<resources>
<s:slicestack id="1" zbottom="0">
)"));
  }
  void take(const SlicePlate&, EncodedLayer&& layer) override { zip_.append(layer.piece); }
  void finish(const std::vector<SlicedPlate>&) override {
    std::string text =
        "</s:slicestack>\n<object id=\"2\" type=\"model\" s:slicestackid=\"1\" s:meshresolution=\"lowres\">\n";
    text += box_mesh(job().plates[0].grid);
    text += "</object>\n</resources>\n<build>\n<item objectid=\"2\"/>\n</build>\n</model>\n";
    zip_.append(deflate_piece(text));
    zip_.close();
    zip_.finish();
  }

 private:
  ZipWriter zip_;
};

}  // namespace

std::unique_ptr<LayerFormat> make_slice_stack(const SliceJob& job, OutputFile& file) {
  return std::make_unique<SliceStack>(job, file);
}

}  // namespace fibrolite
