// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/mesh_io.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "fibrolite/error.h"
#include "mesh_formats.h"
#include "read_file.h"

namespace fibrolite {
namespace {

struct Format {
  const char* ending;
  MeshFile (*read)(const Source&, const Context&);
  void (*write)(OutputFile&, const MeshLayers&, const Context&);
};
constexpr std::array formats{Format{".stl", read_stl, write_stl}, Format{".obj", read_obj, write_obj},
                             Format{".ply", read_ply, write_ply}, Format{".off", read_off, write_off},
                             Format{".3mf", read_3mf, write_3mf}};

const Format& format_of(const std::filesystem::path& path) {
  const std::string ending = lower(path.extension().string());
  const auto* const format =
      std::find_if(formats.begin(), formats.end(), [&](const Format& f) { return ending == f.ending; });
  if (format != formats.end()) return *format;
  std::string known;
  for (const Format& f : formats) known += std::string(known.empty() ? "" : " ") + f.ending;
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw Error(Code::BadInput, "this is a folder, not a model", path.string(), "give a file in it: " + known);
  if (ending.empty())
    throw Error(Code::Unsupported, "the name has no ending that says the format", path.string(), "known are " + known);
  throw Error(Code::Unsupported, "not a mesh format known here: '" + ending + "'", path.string(), "known are " + known);
}

std::vector<std::string> endings() {
  std::vector<std::string> result;
  for (const Format& f : formats) result.emplace_back(f.ending);
  return result;
}

template <class T>
void append_shortest(std::string& text, T value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

}  // namespace

void append_number(std::string& text, float value) { append_shortest(text, value); }
void append_number(std::string& text, std::uint64_t value) { append_shortest(text, value); }

void append_line(std::string& text, Vec3f point) {
  for (const float x : {point.x, point.y, point.z}) append_number(text += ' ', x);
  text += '\n';
}
void append_line(std::string& text, const Mesh::Triangle& corners, std::uint64_t first) {
  for (const std::uint32_t i : corners) append_number(text += ' ', i + first);
  text += '\n';
}

std::vector<std::string> readable_mesh_endings() { return endings(); }
std::vector<std::string> writable_mesh_endings() { return endings(); }

MeshFile read_mesh(const std::filesystem::path& path, const Context& context) {
  const Format& format = format_of(path);
  const FileBytes bytes = read_file(path, context);
  const Source source{bytes.view(), path.string()};
  MeshFile file = format.read(source, context);
  if (file.mesh.triangles.empty()) fail(source, "the model has no triangles", "", "save it with its faces");
  context.progress(1);
  return file;
}

void write_mesh(const std::filesystem::path& path, const Mesh& mesh, const Context& context) {
  write_mesh(path, WholeMesh(mesh), context);
}

void write_mesh(const std::filesystem::path& path, const MeshLayers& mesh, const Context& context) {
  const Format& format = format_of(path);
  if (mesh.triangles() == 0)
    throw Error(Code::BadInput, "there is nothing to write: the mesh has no triangles", path.string());
  OutputFile file(path);
  format.write(file, mesh, context);
  context.check();
  file.commit();
  context.progress(1);
}

}  // namespace fibrolite
