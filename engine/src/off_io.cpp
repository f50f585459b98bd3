// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

// Numbers per vertex after x, y, z, by the letters before OFF: ST (2), C (4, but often 3), N (3). The first line of a
// file without a keyword is its counts. Everything after the coordinates of a line is skipped, so the letters need no
// more care.
void read_keyword(const Source& source, TextCursor& cursor) {
  if (!cursor.skip_space(true)) cursor.fail_here("the file has only comments");
  const std::size_t at = cursor.position();
  const std::string_view keyword = cursor.word();
  std::int64_t number = 0;
  if (parse_integer(keyword, number)) {
    cursor = TextCursor(source, at);
    return;
  }
  std::string_view rest = keyword;
  for (const std::string_view letters : {"ST", "C", "N"})
    if (rest.starts_with(letters)) rest.remove_prefix(letters.size());
  if (rest == "4OFF" || rest == "nOFF" || rest == "4nOFF")
    throw Error(Code::Unsupported, "OFF files with other than 3 coordinates are not read", source.name,
                "save it with x, y, z");
  if (rest != "OFF") fail_at(source, at, "expected 'OFF', found " + shown(keyword), "is it an OFF file?");
  if (cursor.skip_blanks() && source.bytes.substr(cursor.position()).starts_with("BINARY"))
    throw Error(Code::Unsupported, "binary OFF files are not read", source.name, "save it as text");
}

}  // namespace

MeshFile read_off(const Source& source, const Context& context) {
  TextCursor cursor(source);
  read_keyword(source, cursor);
  const auto count = [&](const char* of_what) {
    if (!cursor.skip_space(true))
      cursor.fail_here(std::string("the file ends before the ") + of_what, "is it truncated?");
    const std::int64_t n = cursor.integer(of_what);
    // Every vertex and every face takes two bytes at least: a wild count must not ask for memory.
    if (n < 0 || n > static_cast<std::int64_t>(source.bytes.size() / 2))
      cursor.fail_here(std::string("the ") + of_what + " does not fit the file: " + std::to_string(n),
                       "is it truncated?");
    return static_cast<std::size_t>(n);
  };
  const std::size_t vertices = count("number of vertices"), faces = count("number of faces");
  if (vertices > 0xffffffffu) throw Error(Code::TooLarge, "over 4,294,967,295 vertices", source.name);
  cursor.next_line();  // the number of edges is often missing or wrong

  MeshFile file;
  PolygonSink sink(file);
  file.mesh.vertices.reserve(vertices);
  for (std::size_t i = 0; i < vertices; ++i) {
    if (i % 65536 == 0) context.check();
    if (!cursor.skip_space(true))
      cursor.fail_here("the file ends after " + std::to_string(i) + " of " + std::to_string(vertices) + " vertices",
                       "it is truncated");
    file.mesh.vertices.push_back(cursor.point("coordinate"));
    cursor.next_line();
  }
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i < faces; ++i) {
    if (i % 65536 == 0) context.check();
    if (!cursor.skip_space(true))
      cursor.fail_here("the file ends after " + std::to_string(i) + " of " + std::to_string(faces) + " faces",
                       "it is truncated");
    const std::int64_t n = cursor.integer("number of corners");
    corners.clear();
    if (n < 0) cursor.fail_here("a face with " + std::to_string(n) + " corners");
    for (std::int64_t k = 0; k < n; ++k) {
      const std::int64_t index = cursor.integer("vertex index");
      if (index < 0 || index >= static_cast<std::int64_t>(vertices))
        cursor.fail_here("vertex index " + std::to_string(index) + " is out of range: the file has " +
                         std::to_string(vertices) + " vertices");
      corners.push_back(static_cast<std::uint32_t>(index));
    }
    cursor.next_line();
    sink.add(corners);
  }
  sink.finish();
  return file;
}

void write_off(OutputFile& file, const MeshLayers& mesh, const Context& context) {
  file.write("OFF\n" + std::to_string(mesh.vertices()) + ' ' + std::to_string(mesh.triangles()) + " 0\n");
  const auto vertex = [](std::string& text, Vec3f p) {
    append_number(text, p.x);
    text += ' ';
    append_number(text, p.y);
    text += ' ';
    append_number(text, p.z);
    text += '\n';
  };
  for_vertices(mesh, context.part(0, 0.4, ""), vertex, WriteChunks{file});
  const auto face = [](std::string& text, const MeshLayer& layer, std::size_t t) {
    append_line(text += '3', layer.triangles[t], 0);
  };
  for_triangles(mesh, context.part(0.4, 1, ""), face, WriteChunks{file});
}

}  // namespace fibrolite
