// SPDX-License-Identifier: Apache-2.0
#include "slice_formats.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <utility>

#include "fibrolite/contours.h"
#include "fibrolite/error.h"
#include "png.h"

namespace fibrolite {
namespace {

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

std::string padded(int value, std::size_t digits) {
  std::string text = std::to_string(value);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

/// What any archive, file system and PrusaSlicer take as a name.
std::string plain(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const bool kept = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    text.push_back(kept ? c : '_');
  }
  return text.empty() ? "part" : text;
}

}  // namespace

std::string number(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}
void append_integer(std::string& text, long long value) {
  std::array<char, 24> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

UnitPoint in_units(Vec2d mm) { return {std::llround(mm.x * 1e4), std::llround(mm.y * 1e4)}; }

std::vector<UnitPoint> in_units(const Contour& outline) {
  std::vector<UnitPoint> points;
  for (const Vec2d p : outline.points)
    if (const UnitPoint at = in_units(p); points.empty() || at != points.back()) points.push_back(at);
  while (points.size() > 1 && points.back() == points.front()) points.pop_back();
  if (points.size() < 3) points.clear();
  return points;
}

void append_mm(std::string& text, long long units) {
  append_integer(text, units / 10000);
  const long long rest = units % 10000;
  if (rest != 0) text.append(".").append(padded(static_cast<int>(rest), 4));
}

namespace {

// ---- Archives

/// manifest.json: what a program needs to print the layers, in the order of the plates.
std::string manifest(const SliceJob& job, const std::vector<SlicedPlate>& done, const std::string& ending,
                     const std::function<std::string(const SlicePlate&, int)>& name) {
  std::string text = "{\n  \"schema\": 1,\n  \"name\": \"";
  text += plain(job.name) + "\",\n  \"plates\": [";
  for (std::size_t p = 0; p < done.size(); ++p) {
    const SliceGrid& grid = job.plates[p].grid;
    text += p == 0 ? "\n    {" : ",\n    {";
    text += "\"name\": \"" + job.plates[p].name + "\", \"layers\": " + std::to_string(grid.layers);
    text += ", \"layer_mm\": " + number(grid.layer_mm);
    text += ", \"pixel_mm\": [" + number(grid.pixel_mm.x) + ", " + number(grid.pixel_mm.y) + "]";
    text += ", \"size_px\": [" + std::to_string(grid.width) + ", " + std::to_string(grid.height) + "]";
    const Vec3d o = grid.frame.origin;
    text += ", \"origin_mm\": [" + number(o.x) + ", " + number(o.y) + ", " + number(o.z) + "]";
    text += ", \"volume_mm3\": " + number(done[p].volume_mm3) + ",\n     \"files\": [";
    for (int n = 0; n < grid.layers; ++n) {
      text += n == 0 ? "\n" : ",\n";
      text += "      {\"file\": \"" + name(job.plates[p], n) + ending;
      text += "\", \"area_mm2\": " + number(done[p].area_mm2[static_cast<std::size_t>(n)]) + "}";
    }
    text += "\n    ]}";
  }
  return text + "\n  ]\n}\n";
}

std::string layer_name(const SlicePlate& plate, int layer) {
  std::string name = plate.name;
  if (!name.empty()) name += "/";
  name += "layer_";
  return name += padded(layer, 5);
}

class PngArchive : public LayerFormat {
 public:
  PngArchive(const SliceJob& job, OutputFile& file) : LayerFormat(job), zip_(file) {}
  [[nodiscard]] EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const override {
    Slice made = slice(shape, plate.grid, layer, {.planes = job().planes});
    return {layer, {}, stored_piece(png_upright(shown(std::move(made.coverage)))), made.area_mm2};
  }
  void take(const SlicePlate& plate, EncodedLayer&& layer) override {
    zip_.add_stored(name(plate, layer.layer) + ".png", layer.piece);
  }
  void finish(const std::vector<SlicedPlate>& done) override {
    zip_.add("manifest.json", manifest(job(), done, ".png", layer_name));
    zip_.finish();
  }

 protected:
  [[nodiscard]] virtual GrayImage shown(GrayImage&& image) const { return std::move(image); }
  [[nodiscard]] virtual std::string name(const SlicePlate& plate, int layer) const { return layer_name(plate, layer); }
  ZipWriter& zip() { return zip_; }

 private:
  ZipWriter zip_;
};

/// Facts about the format: PrusaSlicer's documentation and what its own exports hold. jobDir is in the names of the
/// pictures, in small letters; a picture of a portrait screen has the printer's y along its rows.
class Sl1Archive final : public PngArchive {
 public:
  using PngArchive::PngArchive;
  void finish(const std::vector<SlicedPlate>& done) override {
    const SliceGrid& grid = job().plates[0].grid;
    const std::string height = number(grid.layer_mm);
    std::string config = "action = print\nexpTime = 8\nexpTimeFirst = 35\nexpUserProfile = 0\nhollow = 0\njobDir = ";
    config += prefix() + "\nlayerHeight = " + height + "\nmaterialName = \nnumFade = 10\n";
    config += "numFast = " + std::to_string(grid.layers) + "\nnumSlow = 0\nprintProfile = \nprintTime = ";
    config += number(14.0 * grid.layers) + "\nprinterModel = SL1\nprinterProfile = \nprinterVariant = default\n";
    config += "prusaSlicerVersion = PrusaSlicer-2.5.0\nusedMaterial = " + number(1e-3 * done[0].volume_mm3) + "\n";
    zip().add("config.ini", config);

    const double wide = grid.width * grid.pixel_mm.x, deep = grid.height * grid.pixel_mm.y;
    std::string profile = "bed_shape = 0x0,";
    profile += number(wide) + "x0," + number(wide) + "x" + number(deep) + ",0x" + number(deep) + "\n";
    profile += "display_height = " + number(deep) + "\ndisplay_mirror_x = " + (job().screen.mirrored ? "1" : "0");
    profile += std::string("\ndisplay_mirror_y = 0\ndisplay_orientation = ");
    profile += (job().screen.portrait ? "portrait" : "landscape");
    profile += "\ndisplay_pixels_x = " + std::to_string(grid.width);
    profile += "\ndisplay_pixels_y = " + std::to_string(grid.height) + "\ndisplay_width = " + number(wide);
    profile += "\ngamma_correction = 1\ninitial_layer_height = " + height + "\nlayer_height = " + height;
    profile += "\nmax_print_height = " + number(grid.layers * grid.layer_mm) + "\nprinter_technology = SLA\n";
    zip().add("prusaslicer.ini", profile);
    zip().finish();
  }

 protected:
  [[nodiscard]] GrayImage shown(GrayImage&& image) const override {
    if (!job().screen.portrait && !job().screen.mirrored) return std::move(image);
    const int w = image.width, h = image.height;
    GrayImage out = job().screen.portrait ? GrayImage(h, w) : GrayImage(w, h);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        if (job().screen.portrait) {
          // A quarter turn; the mirror image of one for a screen that is seen from below.
          out(job().screen.mirrored ? y : h - 1 - y, x) = image(x, y);
        } else {
          out(w - 1 - x, y) = image(x, y);
        }
      }
    }
    return out;
  }
  [[nodiscard]] std::string name(const SlicePlate&, int layer) const override { return prefix() + padded(layer, 5); }

 private:
  [[nodiscard]] std::string prefix() const { return lower(plain(job().name)); }
};

// ---- Outlines

double total_area(const std::vector<Contour>& outlines) {
  double sum = 0;
  for (const Contour& outline : outlines) sum += outline.area_mm2;
  return sum;
}

/// One path for all outlines of a layer: by the even-odd rule, holes are holes.
std::string svg_path(const std::vector<Contour>& outlines, const SliceGrid& grid) {
  std::string text = "<path fill-rule=\"evenodd\" d=\"";
  const double top = grid.height * grid.pixel_mm.y;  // y points down in an SVG
  // Never negative: outlines end at the rim.
  for (const Contour& outline : outlines) {
    char command = 'M';
    for (const Vec2d p : outline.points) {
      const UnitPoint at = in_units(Vec2d{p.x, top - p.y});
      text.push_back(command);
      append_mm(text, at.x);
      text.push_back(' ');
      append_mm(text, at.y);
      command = 'L';
    }
    text.push_back('Z');
  }
  return text + "\"/>\n";
}

std::string svg_head(const SliceGrid& grid) {
  const std::string width = number(grid.width * grid.pixel_mm.x), height = number(grid.height * grid.pixel_mm.y);
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width +
         "mm\" height=\"" + height + "mm\" viewBox=\"0 0 " + width + " " + height + "\">\n";
}

class SvgArchive final : public LayerFormat {
 public:
  SvgArchive(const SliceJob& job, OutputFile& file) : LayerFormat(job), zip_(file) {}
  [[nodiscard]] EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const override {
    const std::vector<Contour> outlines = contours(shape, plate.grid, layer);
    return {layer,
            {},
            deflate_piece(svg_head(plate.grid) + svg_path(outlines, plate.grid) + "</svg>\n"),
            total_area(outlines)};
  }
  void take(const SlicePlate& plate, EncodedLayer&& layer) override {
    zip_.add(layer_name(plate, layer.layer) + ".svg", {std::move(layer.piece)});
  }
  void finish(const std::vector<SlicedPlate>& done) override {
    zip_.add("manifest.json", manifest(job(), done, ".svg", layer_name));
    zip_.finish();
  }

 private:
  ZipWriter zip_;
};

class SvgFile final : public LayerFormat {
 public:
  SvgFile(const SliceJob& job, OutputFile& file) : LayerFormat(job), file_(&file) {}
  [[nodiscard]] EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const override {
    const std::vector<Contour> outlines = contours(shape, plate.grid, layer);
    std::string text = "<g id=\"layer" + std::to_string(layer);
    text += "\" data-z-mm=\"" + number((layer + 1) * plate.grid.layer_mm) + "\">\n";
    return {layer, text + svg_path(outlines, plate.grid) + "</g>\n", {}, total_area(outlines)};
  }
  void start() override { file_->write(svg_head(job().plates[0].grid)); }
  void take(const SlicePlate&, EncodedLayer&& layer) override { file_->write(layer.bytes); }
  void finish(const std::vector<SlicedPlate>&) override { file_->write("</svg>\n"); }

 private:
  OutputFile* file_;
};

/// Source: Common Layer Interface, version 2.0 (EU project Brite-EuRam 5278). A layer is named by the height of its
/// top, in units; one without outlines at the bottom says how high the first is. Direction 1: round material, 0: round
/// a hole. An outline ends with its first point.
class CliFile final : public LayerFormat {
 public:
  CliFile(const SliceJob& job, OutputFile& file) : LayerFormat(job), file_(&file) {}
  [[nodiscard]] EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const override {
    const std::vector<Contour> outlines = contours(shape, plate.grid, layer);
    std::string text = "$$LAYER/";
    append_integer(text, std::llround((layer + 1) * plate.grid.layer_mm * 1e4));
    text += "\n";
    for (const Contour& outline : outlines) {
      std::vector<UnitPoint> points = in_units(outline);
      if (points.empty()) continue;
      points.push_back(points.front());
      text += outline.area_mm2 > 0 ? "$$POLYLINE/1,1," : "$$POLYLINE/1,0,";
      append_integer(text, static_cast<long long>(points.size()));
      for (const UnitPoint& p : points) {
        text += ",";
        append_integer(text, p.x);
        text += ",";
        append_integer(text, p.y);
      }
      text += "\n";
    }
    return {layer, std::move(text), {}, total_area(outlines)};
  }
  void start() override {
    std::string text = "$$HEADERSTART\n$$ASCII\n$$UNITS/0.0001\n$$VERSION/200\n$$LABEL/1,";
    text += plain(job().name) + "\n$$LAYERS/" + std::to_string(job().plates[0].grid.layers + 1);
    file_->write(text + "\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/0\n");
  }
  void take(const SlicePlate&, EncodedLayer&& layer) override { file_->write(layer.bytes); }
  void finish(const std::vector<SlicedPlate>&) override { file_->write("$$GEOMETRYEND\n"); }

 private:
  OutputFile* file_;
};

}  // namespace

SliceFormat slice_format(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  if (name.ends_with(".svg.zip")) return SliceFormat::SvgZip;
  if (name.ends_with(".zip")) return SliceFormat::PngZip;
  if (name.ends_with(".sl1")) return SliceFormat::Sl1;
  if (name.ends_with(".svg")) return SliceFormat::Svg;
  if (name.ends_with(".cli")) return SliceFormat::Cli;
  if (name.ends_with(".3mf")) return SliceFormat::ThreeMf;
  throw Error(Code::Unsupported, "not a format of layers", path.string(), "use .zip .sl1 .svg.zip .svg .cli .3mf");
}

int most_layers(SliceFormat format) {
  // Printers that read .sl1 number its entries with 16 bits; two are for what is said about the layers.
  return format == SliceFormat::Sl1 ? 65535 - 2 : 1 << 24;
}

std::unique_ptr<LayerFormat> make_format(SliceFormat format, const SliceJob& job, OutputFile& file) {
  switch (format) {
    case SliceFormat::PngZip:
      return std::make_unique<PngArchive>(job, file);
    case SliceFormat::Sl1:
      return std::make_unique<Sl1Archive>(job, file);
    case SliceFormat::SvgZip:
      return std::make_unique<SvgArchive>(job, file);
    case SliceFormat::Svg:
      return std::make_unique<SvgFile>(job, file);
    case SliceFormat::Cli:
      return std::make_unique<CliFile>(job, file);
    case SliceFormat::ThreeMf:
      return make_slice_stack(job, file);
  }
  throw Error(Code::Internal, "no such format of layers");
}

}  // namespace fibrolite
