// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

constexpr std::size_t header_bytes = 80, triangle_bytes = 50, first_triangle = header_bytes + 4;

bool begins_with_word(std::string_view text, std::string_view word) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  return begin != std::string_view::npos && lower(text.substr(begin, word.size())) == word;
}

// No control characters at the beginning: binary files have some among their first counts and coordinates.
bool looks_like_text(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, 1024);
  return std::none_of(head.begin(), head.end(), [](char c) {
    return c == 127 || (c >= 0 && c < 32 && c != '\n' && c != '\r' && c != '\t' && c != '\f' && c != '\v');
  });
}

MeshFile read_binary(const Source& source, std::size_t count, const Context& context) {
  if (count > 0xffffffffu / 3) throw Error(Code::TooLarge, "over 1,431,655,765 triangles", source.name);
  MeshFile file;
  file.mesh.vertices.resize(3 * count);
  file.mesh.triangles.resize(count);
  std::atomic<std::size_t> first_bad{count};
  const std::size_t chunks = (count + items_per_chunk - 1) / items_per_chunk;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    if (context.cancelled()) return;
    const std::size_t end = std::min(count, (chunk + 1) * items_per_chunk);
    for (std::size_t t = chunk * items_per_chunk; t < end; ++t) {
      std::array<Vec3f, 3> corners;
      std::memcpy(corners.data(), source.bytes.data() + first_triangle + t * triangle_bytes + 12, sizeof corners);
      bool finite = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3f p = corners[i];
        finite = finite && std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
        file.mesh.vertices[3 * t + i] = p;
        file.mesh.triangles[t][i] = static_cast<std::uint32_t>(3 * t + i);
      }
      if (finite) continue;
      std::size_t seen = first_bad;
      while (t < seen && !first_bad.compare_exchange_weak(seen, t)) {
      }
    }
  });
  context.check();
  if (first_bad < count)
    fail(source, "NaN or infinite coordinate",
         "triangle " + std::to_string(first_bad + 1) + " of " + std::to_string(count));
  const std::size_t end = first_triangle + count * triangle_bytes;
  if (source.bytes.size() > end)
    file.notes.push_back(std::to_string(source.bytes.size() - end) + " bytes after the last triangle ignored");
  return file;
}

class AsciiStl {
 public:
  AsciiStl(const Source& source, const Context& context) : source_(source), context_(context), cursor_(source) {}

  MeshFile read() {
    bool in_solid = false;
    while (cursor_.skip_space()) {
      const std::size_t at = cursor_.position();
      const std::string word = lower(cursor_.word());
      if (word == "solid") {
        if (in_solid) fail_at(source_, at, "'solid' inside a solid");
        cursor_.next_line();  // the rest is a name
        in_solid = true;
      } else if (word == "endsolid" && in_solid) {
        cursor_.next_line();
        in_solid = false;
      } else if (word == "facet" && in_solid) {
        facet();
      } else {
        fail_at(source_, at, "expected 'facet' or 'endsolid', found " + shown(word), "is it an STL file?");
      }
    }
    if (in_solid) cursor_.fail_here("the file ends without 'endsolid'", "it is truncated");
    sink_.finish();
    return std::move(file_);
  }

 private:
  void expect(const char* expected) {
    const std::string_view word = cursor_.word();
    if (lower(word) != expected)
      cursor_.fail_here(std::string("expected '") + expected + "', found " +
                        (word.empty() ? "the end of the file" : shown(word)));
  }

  void facet() {
    expect("normal");
    for (int i = 0; i < 3; ++i) cursor_.word();  // normals are often wrong, even NaN; the corners say it all
    expect("outer");
    expect("loop");
    corners_.clear();
    for (;;) {
      const std::string_view word = cursor_.word();
      if (word == "vertex" || lower(word) == "vertex") {
        corners_.push_back(static_cast<std::uint32_t>(file_.mesh.vertices.size()));
        file_.mesh.vertices.push_back(cursor_.point("coordinate"));
      } else if (lower(word) == "endloop") {
        break;
      } else {
        cursor_.fail_here("expected 'vertex' or 'endloop', found " +
                          (word.empty() ? "the end of the file" : shown(word)));
      }
    }
    expect("endfacet");
    sink_.add(corners_);
    if (file_.mesh.triangles.size() % 65536 == 0) context_.check();
  }

  const Source& source_;
  const Context& context_;
  TextCursor cursor_;
  MeshFile file_;
  PolygonSink sink_{file_};
  std::vector<std::uint32_t> corners_;
};

}  // namespace

MeshFile read_stl(const Source& source, const Context& context) {
  const std::string_view bytes = source.bytes;
  std::uint32_t count = 0;
  if (bytes.size() >= first_triangle) std::memcpy(&count, bytes.data() + header_bytes, sizeof count);
  const std::size_t expected = first_triangle + std::size_t{count} * triangle_bytes;
  // Many binary files begin with 'solid' too: the size decides first.
  if (bytes.size() == expected) return read_binary(source, count, context);
  if (looks_like_text(bytes)) {
    if (begins_with_word(bytes, "solid")) return AsciiStl(source, context).read();
    fail(source, "a text file, but not an STL: it does not begin with 'solid'", "line 1");
  }
  if (bytes.size() < first_triangle) fail(source, "too short for an STL file", std::to_string(bytes.size()) + " bytes");
  if (bytes.size() < expected)
    fail(source, "not a whole STL file",
         "the header promises " + std::to_string(count) + " triangles in " + std::to_string(expected) +
             " bytes, the file has " + std::to_string(bytes.size()),
         "it is truncated or damaged");
  return read_binary(source, count, context);
}

void write_stl(OutputFile& file, const MeshLayers& mesh, const Context& context) {
  if (mesh.triangles() > 0xffffffffu) throw Error(Code::TooLarge, "an STL file holds at most 4,294,967,295 triangles");
  std::string header = "Binary STL, millimetres, by Fibrolite";  // must not begin with 'solid'
  header.resize(header_bytes, ' ');
  append_bytes(header, static_cast<std::uint32_t>(mesh.triangles()));
  file.write(header);
  struct Record {
    std::array<Vec3f, 4> normal_and_corners;
  };
  const auto append = [](std::string& text, const MeshLayer& layer, std::size_t t) {
    const auto& [ia, ib, ic] = layer.triangles[t];
    const Vec3f a = layer.at(ia), b = layer.at(ib), c = layer.at(ic);
    const Vec3d normal = normalized(cross(to_double(b) - to_double(a), to_double(c) - to_double(a)));
    if (text.empty()) text.reserve(items_per_chunk * triangle_bytes);
    append_bytes(text, Record{{to_float(normal), a, b, c}});
    text.append(2, '\0');
  };
  for_triangles(mesh, context, append, WriteChunks{file});
}

}  // namespace fibrolite
