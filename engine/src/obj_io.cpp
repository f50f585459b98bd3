// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

class ObjReader {
 public:
  ObjReader(const Source& source, const Context& context) : source_(source), context_(context), cursor_(source) {}

  MeshFile read() {
    for (std::size_t line = 0; cursor_.skip_space(); ++line) {
      if (line % 65536 == 0) {
        context_.check();
        context_.progress(static_cast<double>(cursor_.position()) / static_cast<double>(source_.bytes.size()));
      }
      const std::string_view keyword = cursor_.word();
      if (keyword == "v") {
        // What may follow, a weight or a colour, does not move the point.
        file_.mesh.vertices.push_back(cursor_.point("coordinate"));
      } else if (keyword == "f") {
        face();
      }
      while (cursor_.skip_blanks()) cursor_.word();
    }
    if (file_.mesh.vertices.size() > 0xffffffffu)
      throw Error(Code::TooLarge, "over 4,294,967,295 vertices", source_.name);
    if (highest_ > file_.mesh.vertices.size()) out_of_range(highest_at_, static_cast<std::int64_t>(highest_));
    sink_.finish();
    return std::move(file_);
  }

 private:
  [[noreturn]] void out_of_range(std::size_t at, std::int64_t index) const {
    fail_at(source_, at,
            "vertex index " + std::to_string(index) + " is out of range: the file has " +
                std::to_string(file_.mesh.vertices.size()) + " vertices");
  }

  void face() {
    corners_.clear();
    while (cursor_.skip_blanks()) {
      const std::size_t at = cursor_.position();
      const std::string_view word = cursor_.word();
      const std::string_view vertex = word.substr(0, word.find('/'));  // v, v/t, v//n or v/t/n
      std::int64_t index = 0;
      if (!parse_integer(vertex, index)) fail_at(source_, at, "not a vertex index: " + shown(word));
      const auto known = static_cast<std::int64_t>(file_.mesh.vertices.size());
      if (index == 0 || index < -known || index > 0xffffffffLL) out_of_range(at, index);
      if (index < 0) index += known + 1;  // counted back from the last vertex so far
      if (index > known && static_cast<std::size_t>(index) > highest_) {
        highest_ = static_cast<std::size_t>(index);
        highest_at_ = at;
      }
      corners_.push_back(static_cast<std::uint32_t>(index - 1));
    }
    sink_.add(corners_);
  }

  const Source& source_;
  const Context& context_;
  TextCursor cursor_;
  MeshFile file_;
  PolygonSink sink_{file_};
  std::vector<std::uint32_t> corners_;
  std::size_t highest_ = 0, highest_at_ = 0;  // the highest index used before its vertex
};

}  // namespace

MeshFile read_obj(const Source& source, const Context& context) { return ObjReader(source, context).read(); }

void write_obj(OutputFile& file, const MeshLayers& mesh, const Context& context) {
  file.write("# Millimetres, by Fibrolite\n");
  const auto vertex = [](std::string& text, Vec3f p) { append_line(text += 'v', p); };
  for_vertices(mesh, context.part(0, 0.4, ""), vertex, WriteChunks{file});
  const auto face = [](std::string& text, const MeshLayer& layer, std::size_t t) {
    append_line(text += 'f', layer.triangles[t], 1);
  };
  for_triangles(mesh, context.part(0.4, 1, ""), face, WriteChunks{file});
}

}  // namespace fibrolite
