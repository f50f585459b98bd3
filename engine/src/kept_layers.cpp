// SPDX-License-Identifier: Apache-2.0
#include "kept_layers.h"

#include <algorithm>
#include <utility>

namespace fibrolite {
namespace {

// Flushing a file to disk takes milliseconds, a layer of a large part a tenth of a second.
constexpr int batch_layers = 16;

std::string word_of(SliceFormat format) {
  switch (format) {
    case SliceFormat::PngZip:
      return "png";
    case SliceFormat::Sl1:
      return "sl1";
    case SliceFormat::SvgZip:
      return "svgzip";
    case SliceFormat::Svg:
      return "svg";
    case SliceFormat::Cli:
      return "cli";
    case SliceFormat::ThreeMf:
      return "3mf";
  }
  return "";
}

}  // namespace

KeptLayers::KeptLayers(KeptWork* work, SliceFormat format, std::size_t plate, int layers)
    : work_(work), name_("layers-"), layers_(layers) {
  name_.append(word_of(format)).append("-").append(std::to_string(plate)).append("-");
}

std::string KeptLayers::part(int first) const { return std::string(name_).append(std::to_string(first)); }

int KeptLayers::end_of_batch(int first) const { return std::min(layers_, first - first % batch_layers + batch_layers); }

int KeptLayers::count() const {
  int all = 0;
  for (int first = 0; first < layers_; first = end_of_batch(first)) all += kept_until(first) - first;
  return all;
}

int KeptLayers::kept_until(int first) const {
  const bool kept = work_ != nullptr && first % batch_layers == 0 && work_->holds(part(first));
  return kept ? end_of_batch(first) : first;
}

int KeptLayers::missing_until(int first) const {
  while (first < layers_ && kept_until(first) == first) first = end_of_batch(first);
  return first;
}

void KeptLayers::read(int first, const std::function<void(EncodedLayer&&)>& use) const {
  KeptWork::Reader reader = work_->read(part(first));
  for (int n = first; n < end_of_batch(first); ++n) {
    EncodedLayer layer;
    layer.layer = n;
    reader.get(layer.area_mm2);
    reader.get_list(layer.bytes);
    reader.get_list(layer.piece.bytes);
    reader.get(layer.piece.crc);
    reader.get(layer.piece.raw_size);
    use(std::move(layer));
  }
}

void KeptLayers::add(const EncodedLayer& layer) {
  if (work_ == nullptr) return;
  const int end = end_of_batch(layer.layer);
  if (!batch_) batch_ = work_->write(part(layer.layer));
  batch_->put(layer.area_mm2);
  batch_->put_list(layer.bytes);
  batch_->put_list(layer.piece.bytes);
  batch_->put(layer.piece.crc);
  batch_->put(layer.piece.raw_size);
  if (layer.layer + 1 < end) return;
  batch_->commit();
  batch_.reset();
}

}  // namespace fibrolite
