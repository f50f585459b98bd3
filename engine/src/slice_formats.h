// SPDX-License-Identifier: Apache-2.0
// How each format of layers says one layer, and what stands before and after them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fibrolite/contours.h"
#include "fibrolite/file.h"
#include "fibrolite/slice_io.h"
#include "zip_writer.h"

namespace fibrolite {

/// One layer, ready to be written.
struct EncodedLayer {
  int layer = 0;
  std::string bytes;
  DeflatedPiece piece;  // of an archive
  double area_mm2 = 0;
};

/// One format. encode() is called from several threads at once; the rest in order, from one.
class LayerFormat {
 public:
  explicit LayerFormat(const SliceJob& job) : job_(job) {}
  virtual ~LayerFormat() = default;
  LayerFormat(const LayerFormat&) = delete;
  LayerFormat& operator=(const LayerFormat&) = delete;
  [[nodiscard]] virtual EncodedLayer encode(const Shape& shape, const SlicePlate& plate, int layer) const = 0;
  virtual void start() {}
  virtual void take(const SlicePlate& plate, EncodedLayer&& layer) = 0;
  virtual void finish(const std::vector<SlicedPlate>& done) = 0;

 protected:
  [[nodiscard]] const SliceJob& job() const { return job_; }

 private:
  const SliceJob& job_;
};

// What formats share.

/// The shortest text that reads back to the same value.
[[nodiscard]] std::string number(double value);
void append_integer(std::string& text, long long value);
/// A tenth of a micrometre: finer than any printer.
struct UnitPoint {
  long long x = 0, y = 0;
  friend bool operator==(const UnitPoint&, const UnitPoint&) = default;
};
[[nodiscard]] UnitPoint in_units(Vec2d mm);
/// Of an outline, the first point not repeated, none twice in a row; empty if less than a triangle is left of it.
[[nodiscard]] std::vector<UnitPoint> in_units(const Contour& outline);
/// In mm, without needless zeros; units must not be negative.
void append_mm(std::string& text, long long units);

[[nodiscard]] std::unique_ptr<LayerFormat> make_slice_stack(const SliceJob& job, OutputFile& file);  // slice_3mf.cpp
[[nodiscard]] std::unique_ptr<LayerFormat> make_format(SliceFormat format, const SliceJob& job, OutputFile& file);

}  // namespace fibrolite
