// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/slice_io.h"

#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "kept_layers.h"
#include "slice_formats.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;

/// Layers in work at a time: enough that no thread waits for the one that writes.
std::size_t layers_at_once() {
  return 2 * tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

/// Layers [first, last) of one shape, to `take` in order.
template <class Take>
void make_layers(const LayerFormat& format, const Shape& shape, const SlicePlate& plate, int first, int last,
                 const Take& take, const Context& context) {
  using Layer = std::shared_ptr<EncodedLayer>;
  int next = first;
  const auto number = [&](tbb::flow_control& control) {
    if (next < last) return next++;
    control.stop();
    return 0;
  };
  const auto encode = [&](int layer) {
    context.check();
    return std::make_shared<EncodedLayer>(format.encode(shape, plate, layer));
  };
  tbb::parallel_pipeline(layers_at_once(),
                         tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, number) &
                             tbb::make_filter<int, Layer>(tbb::filter_mode::parallel, encode) &
                             tbb::make_filter<Layer, void>(tbb::filter_mode::serial_in_order,
                                                           [&](const Layer& layer) { take(std::move(*layer)); }));
}

SlicedPlate write_plate(LayerFormat& format, KeptLayers& kept, const SliceJob& job, const SlicePlate& plate,
                        const Context& context) {
  SlicedPlate done;
  const auto take = [&](EncodedLayer&& layer) {
    done.area_mm2.push_back(layer.area_mm2);
    format.take(plate, std::move(layer));
    context.progress(static_cast<double>(done.area_mm2.size()) / plate.grid.layers);
  };
  const auto keep_and_take = [&](EncodedLayer&& layer) {
    kept.add(layer);
    take(std::move(layer));
  };
  for (int first = 0; first < plate.grid.layers;) {
    context.check();
    if (const int end = kept.kept_until(first); end > first) {
      kept.read(first, take);
      first = end;
      continue;
    }
    const LayerRun run = job.run_from ? job.run_from(plate, first) : LayerRun{plate.grid.layers, job.shape};
    const int last = std::clamp(run.last, first + 1, kept.missing_until(first));
    make_layers(format, run.shape, plate, first, last, keep_and_take, context);
    first = last;
  }
  for (const double area : done.area_mm2) done.volume_mm3 += area * plate.grid.layer_mm;
  return done;
}

}  // namespace

std::vector<SlicedPlate> write_slices(const fs::path& path, SliceFormat format, const SliceJob& job,
                                      const Context& context) {
  if (job.plates.empty() || (job.plates.size() > 1 && format != SliceFormat::PngZip))
    throw Error(Code::Unsupported, "several plates in one file", path.string(), "use .zip");
  std::int64_t layers = 0;
  for (const SlicePlate& plate : job.plates) layers += plate.grid.layers;
  if (layers > most_layers(format)) {
    throw Error(Code::TooLarge,
                std::to_string(layers) + " layers, more than the " + std::to_string(most_layers(format)) +
                    " that the format holds",
                path.string(), "use higher layers");
  }
  std::vector<KeptLayers> kept;
  std::int64_t kept_layers = 0;
  for (const SlicePlate& plate : job.plates) {
    kept.emplace_back(job.kept.get(), format, kept.size(), plate.grid.layers);
    kept_layers += kept.back().count();
  }
  if (kept_layers > 0) context.log("resumed layers " + std::to_string(kept_layers) + " of " + std::to_string(layers));
  OutputFile file(path);
  const std::unique_ptr<LayerFormat> writer = make_format(format, job, file);
  writer->start();
  std::vector<SlicedPlate> done;
  for (const SlicePlate& plate : job.plates) {
    const auto n = static_cast<double>(done.size()), all = static_cast<double>(job.plates.size());
    done.push_back(write_plate(*writer, kept[done.size()], job, plate, context.part(n / all, (n + 1) / all, "layers")));
  }
  writer->finish(done);
  file.commit();
  context.progress(1);
  return done;
}

double slicing_memory(const SliceGrid& grid) {
  // The picture, turned and as PNG, is less than three bytes a pixel.
  return 3.0 * grid.width * grid.height * static_cast<double>(layers_at_once()) + 32e6;
}

}  // namespace fibrolite
