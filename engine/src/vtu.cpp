// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/vtu.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>

#include "fibrolite/error.h"
#include "fibrolite/file.h"

namespace fibrolite {
namespace {

static_assert(std::endian::native == std::endian::little, "the header says little-endian");

constexpr std::uint8_t quadratic_tetra = 24;  // VTK_QUADRATIC_TETRA, whose order of nodes is ours

void check(const std::vector<VtuField>& fields, std::size_t count) {
  for (const VtuField& field : fields) {
    const bool fits = field.components > 0 && field.values.size() == count * static_cast<std::size_t>(field.components);
    if (!fits) throw Error(Code::BadInput, "the field " + field.name + " does not fit the mesh", "vtu");
    if (!std::all_of(field.values.begin(), field.values.end(), [](double v) { return std::isfinite(v); }))
      throw Error(Code::BadInput, "the field " + field.name + " holds a value that is no number", "vtu");
  }
}

/// The XML names each array with its place in the block of raw data that follows, where it lies behind its size.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& path) : file_(path) {}

  void text(const std::string& line) { file_.write(line); }
  void array(const std::string& type, const std::string& name, int components, std::uint64_t bytes,
             std::function<void(OutputFile&)> data) {
    text("<DataArray type=\"" + type + "\" Name=\"" + name + "\" NumberOfComponents=\"" + std::to_string(components) +
         "\" format=\"appended\" offset=\"" + std::to_string(offset_) + "\"/>\n");
    offset_ += sizeof(std::uint64_t) + bytes;
    blocks_.push_back({bytes, std::move(data)});
  }
  void fields(const std::vector<VtuField>& list) {
    for (const VtuField& field : list)
      array("Float64", field.name, field.components, field.values.size() * sizeof(double),
            [&](OutputFile& file) { file.write(std::as_bytes(std::span(field.values))); });
  }
  void finish(const Context& context) {
    text("<AppendedData encoding=\"raw\">\n_");
    for (const Block& block : blocks_) {
      context.check();
      file_.write(std::as_bytes(std::span(&block.bytes, 1)));
      block.data(file_);
    }
    text("\n</AppendedData>\n</VTKFile>\n");
    file_.commit();
  }

 private:
  struct Block {
    std::uint64_t bytes;
    std::function<void(OutputFile&)> data;
  };
  OutputFile file_;
  std::uint64_t offset_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace

void write_vtu(const std::filesystem::path& path, const TetMesh& mesh, const std::vector<VtuField>& nodes,
               const std::vector<VtuField>& tets, const Context& context) {
  check(nodes, mesh.nodes.size());
  check(tets, mesh.tets.size());
  static_assert(sizeof(Vec3d) == 3 * sizeof(double));
  const std::uint64_t n = mesh.tets.size();
  Writer out(path);
  out.text(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"" +
      std::to_string(mesh.nodes.size()) + "\" NumberOfCells=\"" + std::to_string(n) + "\">\n<Points>\n");
  out.array("Float64", "Points", 3, mesh.nodes.size() * sizeof(Vec3d),
            [&](OutputFile& file) { file.write(std::as_bytes(std::span(mesh.nodes))); });
  out.text("</Points>\n<Cells>\n");
  out.array("UInt32", "connectivity", 1, n * 10 * sizeof(std::uint32_t),
            [&](OutputFile& file) { file.write(std::as_bytes(std::span(mesh.tets))); });
  out.array("Int64", "offsets", 1, n * sizeof(std::int64_t), [n](OutputFile& file) {
    for (std::uint64_t i = 1; i <= n; ++i) {
      const std::uint64_t end = 10 * i;
      file.write(std::as_bytes(std::span(&end, 1)));
    }
  });
  out.array("UInt8", "types", 1, n, [n](OutputFile& file) {
    const std::vector<std::uint8_t> types(n, quadratic_tetra);
    file.write(std::as_bytes(std::span(types)));
  });
  out.text("</Cells>\n<PointData>\n");
  out.fields(nodes);
  out.text("</PointData>\n<CellData>\n");
  out.fields(tets);
  out.text("</CellData>\n</Piece>\n</UnstructuredGrid>\n");
  out.finish(context);
}

}  // namespace fibrolite
