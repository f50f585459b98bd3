// SPDX-License-Identifier: Apache-2.0
// Layers as they stand in a file, kept in batches for a run that goes on.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "fibrolite/kept_work.h"
#include "slice_formats.h"

namespace fibrolite {

/// Of one plate in one format. Without a `work` nothing is kept.
class KeptLayers {
 public:
  KeptLayers(KeptWork* work, SliceFormat format, std::size_t plate, int layers);
  /// Layers that need not be made.
  [[nodiscard]] int count() const;
  /// Where the kept layers that begin with this one end; at `first` itself if it is to be made.
  [[nodiscard]] int kept_until(int first) const;
  /// Where the layers end that are to be made from this one on.
  [[nodiscard]] int missing_until(int first) const;
  /// The kept layers that begin with this one, in order. Memory: a layer. @throws Error Io.
  void read(int first, const std::function<void(EncodedLayer&&)>& use) const;
  /// A layer that was made, in order. @throws Error Io.
  void add(const EncodedLayer& layer);

 private:
  [[nodiscard]] std::string part(int first) const;
  [[nodiscard]] int end_of_batch(int first) const;
  KeptWork* work_;
  std::string name_;
  int layers_;
  std::optional<KeptWork::Writer> batch_;
};

}  // namespace fibrolite
