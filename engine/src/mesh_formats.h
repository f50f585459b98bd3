// SPDX-License-Identifier: Apache-2.0
// One reader and one writer per mesh file format, and what they share.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "fibrolite/context.h"
#include "fibrolite/file.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/mesh_layers.h"
#include "text_cursor.h"

namespace fibrolite {

MeshFile read_stl(const Source& source, const Context& context);
MeshFile read_obj(const Source& source, const Context& context);
MeshFile read_ply(const Source& source, const Context& context);
MeshFile read_off(const Source& source, const Context& context);
MeshFile read_3mf(const Source& source, const Context& context);

void write_stl(OutputFile& file, const MeshLayers& mesh, const Context& context);
void write_obj(OutputFile& file, const MeshLayers& mesh, const Context& context);
void write_ply(OutputFile& file, const MeshLayers& mesh, const Context& context);
void write_off(OutputFile& file, const MeshLayers& mesh, const Context& context);
void write_3mf(OutputFile& file, const MeshLayers& mesh, const Context& context);

/// Splits polygons into triangles: a fan from the first corner, or by cutting ears where that would leave the polygon.
class PolygonSink {
 public:
  explicit PolygonSink(MeshFile& file) : file_(&file) {}
  /// Corners are indices of vertices that may come later in the file. Returns the number of triangles added.
  std::size_t add(const std::vector<std::uint32_t>& corners);
  /// Once all vertices are there: mend the fans of concave polygons, and turn counts into notes.
  void finish();

 private:
  struct Fan {
    std::uint32_t first_triangle, triangles;
  };
  MeshFile* file_;
  std::vector<Fan> fans_;  // of polygons with more than three corners
  std::int64_t too_few_corners_ = 0;
};

constexpr std::size_t items_per_chunk = std::size_t{1} << 14;
constexpr std::size_t chunks_at_once = 32;

/// Call `append(text, i)` for the items [0, count) in parallel, a chunk of items per string, and `use(text)` for the
/// chunks in their order. Memory: a few tens of MB, whatever the count.
template <class Append, class Use>
void for_chunks_in_order(std::size_t count, const Context& context, const Append& append, const Use& use) {
  using Chunk = decltype(use.prepare(std::string{}));
  const std::size_t chunks = (count + items_per_chunk - 1) / items_per_chunk;
  std::vector<Chunk> ready(std::min(chunks, chunks_at_once));
  for (std::size_t begin = 0; begin < chunks; begin += chunks_at_once) {
    context.check();
    const std::size_t n = std::min(chunks - begin, chunks_at_once);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t k) {
      std::string text;
      const std::size_t first = (begin + k) * items_per_chunk, end = std::min(count, first + items_per_chunk);
      for (std::size_t i = first; i < end; ++i) append(text, i);
      ready[k] = use.prepare(std::move(text));
    });
    for (std::size_t k = 0; k < n; ++k) use.take(std::move(ready[k]));
  }
}

/// The plain use of chunks: write them.
struct WriteChunks {
  OutputFile& file;
  static std::string prepare(std::string&& text) { return std::move(text); }
  void take(std::string&& text) const { file.write(text); }
};

/// A mesh's vertices, and its triangles, as text or bytes: each layer in chunks.
template <class Append, class Use>
void for_vertices(const MeshLayers& mesh, const Context& context, const Append& append, const Use& use) {
  mesh.each(
      [&](const MeshLayer& layer) {
        const std::span<const Vec3f> fresh = layer.fresh();
        const auto one = [&](std::string& text, std::size_t i) { append(text, fresh[i]); };
        for_chunks_in_order(fresh.size(), context, one, use);
      },
      context);
}
template <class Append, class Use>
void for_triangles(const MeshLayers& mesh, const Context& context, const Append& append, const Use& use) {
  mesh.each(
      [&](const MeshLayer& layer) {
        const auto one = [&](std::string& text, std::size_t t) { append(text, layer, t); };
        for_chunks_in_order(layer.triangles.size(), context, one, use);
      },
      context);
}

static_assert(std::endian::native == std::endian::little, "the binary formats are written as the machine holds them");

/// The bytes of a value.
template <class T>
void append_bytes(std::string& text, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  text.append(bytes.data(), bytes.size());
}
/// The shortest decimal that reads back to the same float.
void append_number(std::string& text, float value);
void append_number(std::string& text, std::uint64_t value);
/// " x y z" and the end of the line.
void append_line(std::string& text, Vec3f point);
/// The same of a triangle's corners, counted from `first`.
void append_line(std::string& text, const Mesh::Triangle& corners, std::uint64_t first);

}  // namespace fibrolite
