// SPDX-License-Identifier: Apache-2.0
#include <Model/COM/NMR_DLLInterfaces.h>

#include <cmath>
#include <optional>
#include <utility>

#include "fibrolite/error.h"
#include "mesh_formats.h"
#include "threemf_package.h"
#include "zip_writer.h"

namespace fibrolite {
namespace {

// Owns one object of lib3mf's C interface.
class Handle {
 public:
  Handle() = default;
  ~Handle() {
    if (object_ != nullptr) NMR::lib3mf_release(object_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  NMR::PLib3MFBase** put() { return &object_; }
  [[nodiscard]] NMR::PLib3MFBase* get() const { return object_; }

 private:
  NMR::PLib3MFBase* object_ = nullptr;
};

// x' = m[0] . (x, y, z, 1), and so on.
struct Transform {
  std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  [[nodiscard]] Vec3d operator()(Vec3d p) const {
    const auto row = [&](std::size_t i) { return m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3]; };
    return {row(0), row(1), row(2)};
  }
  [[nodiscard]] Transform after(const Transform& first) const {
    Transform result;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        result.m[i][j] =
            m[i][0] * first.m[0][j] + m[i][1] * first.m[1][j] + m[i][2] * first.m[2][j] + (j == 3 ? m[i][3] : 0.0);
    return result;
  }
  [[nodiscard]] bool mirrors() const {
    const auto column = [&](std::size_t j) { return Vec3d{m[0][j], m[1][j], m[2][j]}; };
    return dot(column(0), cross(column(1), column(2))) < 0;
  }
};

Transform to_transform(const NMR::MODELTRANSFORM& t) {
  Transform result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) result.m[i][j] = double{t.m_fFields[i][j]};
  return result;
}

class ThreeMfReader {
 public:
  ThreeMfReader(const Source& source, const Context& context) : source_(source), context_(context) {}

  MeshFile read() {
    Handle model;
    must(NMR::lib3mf_createmodel(model.put()));
    load(model);
    DWORD unit = 0;
    must(NMR::lib3mf_model_getunit(model.get(), &unit));
    file_.unit_mm = unit_mm(unit);

    Handle items;
    must(NMR::lib3mf_model_getbuilditems(model.get(), items.put()));
    for (;;) {
      BOOL has_next = 0;
      must(NMR::lib3mf_builditemiterator_movenext(items.get(), &has_next));
      if (has_next == 0) break;
      Handle item, object;
      must(NMR::lib3mf_builditemiterator_getcurrent(items.get(), item.put()));
      must(NMR::lib3mf_builditem_getobjectresource(item.get(), object.put()));
      NMR::MODELTRANSFORM transform{};
      must(NMR::lib3mf_builditem_getobjecttransform(item.get(), &transform));
      add(object, to_transform(transform), 0);
    }
    if (file_.mesh.triangles.empty())
      fail(source_, "the model has no triangles", "", "are there items on its build plate?");
    if (supports_ > 0) file_.notes.push_back(std::to_string(supports_) + " support objects left out");
    return std::move(file_);
  }

 private:
  void must(LIB3MFRESULT result) const {
    if (result != 0) fail(source_, "cannot make sense of the 3MF model", "");
  }

  void load(const Handle& model) const {
    Handle reader;
    must(NMR::lib3mf_model_queryreader(model.get(), "3mf", reader.put()));
    // lib3mf takes bytes without const, and does not write to them.
    auto* const bytes = const_cast<BYTE*>(reinterpret_cast<const BYTE*>(source_.bytes.data()));
    if (NMR::lib3mf_reader_readfrombuffer(reader.get(), bytes, source_.bytes.size()) == 0) return;
    DWORD code = 0;
    LPCSTR message = nullptr;
    NMR::lib3mf_getlasterror(reader.get(), &code, &message);
    fail(source_, "not a readable 3MF file: " + lower(message == nullptr ? "unknown error" : message), "");
  }

  double unit_mm(DWORD unit) const {
    switch (unit) {
      case NMR::MODELUNIT_MICROMETER:
        return 0.001;
      case NMR::MODELUNIT_MILLIMETER:
        return 1;
      case NMR::MODELUNIT_CENTIMETER:
        return 10;
      case NMR::MODELUNIT_INCH:
        return 25.4;
      case NMR::MODELUNIT_FOOT:
        return 304.8;
      case NMR::MODELUNIT_METER:
        return 1000;
      default:
        fail(source_, "unknown unit", "");
    }
  }

  void add(const Handle& object, const Transform& transform, int depth) {
    // Components may share components: a small file can ask for any number of copies.
    constexpr std::int64_t most_objects = 100000;
    constexpr int most_depth = 64;
    if (++objects_ > most_objects || depth > most_depth)
      throw Error(Code::TooLarge, "the 3MF model has too many or too deeply nested components", source_.name);
    DWORD type = 0;
    must(NMR::lib3mf_object_gettype(object.get(), &type));
    if (type == NMR::MODELOBJECTTYPE_SUPPORT || type == NMR::MODELOBJECTTYPE_SOLIDSUPPORT) {
      ++supports_;
      return;
    }
    BOOL is_mesh = 0, is_group = 0;
    must(NMR::lib3mf_object_ismeshobject(object.get(), &is_mesh));
    must(NMR::lib3mf_object_iscomponentsobject(object.get(), &is_group));
    if (is_mesh != 0) add_mesh(object, transform);
    if (is_group == 0) return;
    DWORD count = 0;
    must(NMR::lib3mf_componentsobject_getcomponentcount(object.get(), &count));
    for (DWORD i = 0; i < count; ++i) {
      Handle component, part;
      must(NMR::lib3mf_componentsobject_getcomponent(object.get(), i, component.put()));
      must(NMR::lib3mf_component_getobjectresource(component.get(), part.put()));
      NMR::MODELTRANSFORM own{};
      must(NMR::lib3mf_component_gettransform(component.get(), &own));
      add(part, transform.after(to_transform(own)), depth + 1);
    }
  }

  void add_mesh(const Handle& object, const Transform& transform) {
    context_.check();
    Mesh& mesh = file_.mesh;
    DWORD vertex_count = 0, triangle_count = 0;
    must(NMR::lib3mf_meshobject_getvertexcount(object.get(), &vertex_count));
    must(NMR::lib3mf_meshobject_gettrianglecount(object.get(), &triangle_count));
    constexpr std::size_t most = 400'000'000;  // copies again
    if (mesh.vertices.size() + vertex_count > most || mesh.triangles.size() + triangle_count > most)
      throw Error(Code::TooLarge, "the 3MF model has over 400 million triangles", source_.name);
    if (vertex_count == 0 || triangle_count == 0) return;
    std::vector<NMR::MODELMESHVERTEX> vertices(vertex_count);
    std::vector<NMR::MODELMESHTRIANGLE> triangles(triangle_count);
    must(NMR::lib3mf_meshobject_getvertices(object.get(), vertices.data(), vertex_count, &vertex_count));
    must(NMR::lib3mf_meshobject_gettriangleindices(object.get(), triangles.data(), triangle_count, &triangle_count));

    const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& v : vertices) {
      const Vec3f p =
          to_float(transform({double{v.m_fPosition[0]}, double{v.m_fPosition[1]}, double{v.m_fPosition[2]}}));
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        fail(source_, "NaN, infinite or too large coordinate",
             "vertex " + std::to_string(mesh.vertices.size() - offset + 1));
      mesh.vertices.push_back(p);
    }
    const bool mirrors = transform.mirrors();
    for (const auto& t : triangles) {
      Mesh::Triangle corners{};
      for (std::size_t i = 0; i < 3; ++i) {
        if (t.m_nIndices[i] >= vertices.size())
          fail(source_, "vertex index " + std::to_string(t.m_nIndices[i]) + " is out of range", "");
        corners[i] = offset + t.m_nIndices[i];
      }
      if (mirrors) std::swap(corners[1], corners[2]);
      mesh.triangles.push_back(corners);
    }
  }

  const Source& source_;
  const Context& context_;
  MeshFile file_;
  std::int64_t objects_ = 0, supports_ = 0;
};

// Chunks of the model's text become deflated pieces of the open entry.
struct DeflateChunks {
  ZipWriter& zip;
  static DeflatedPiece prepare(std::string&& text) { return deflate_piece(text); }
  void take(DeflatedPiece&& piece) const { zip.append(piece); }
};

std::string hex(Rgb color) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text = "#";
  for (const unsigned v : {color.r, color.g, color.b}) {
    text += digits[v / 16];
    text += digits[v % 16];
  }
  return text;
}

// The distinct colours, in order of appearance.
class Palette {
 public:
  Palette(const MeshLayers& mesh, const Context& context) : number_(std::size_t{1} << 24, 0) {
    mesh.each(
        [&](const MeshLayer& layer) {
          for (const Rgb c : layer.colors) {
            std::uint32_t& n = number_[place(c)];
            if (n != 0) continue;
            colors_.push_back(c);
            n = static_cast<std::uint32_t>(colors_.size());
          }
        },
        context);
  }
  [[nodiscard]] const std::vector<Rgb>& colors() const { return colors_; }
  [[nodiscard]] std::uint32_t index(Rgb c) const { return number_[place(c)] - 1; }

 private:
  static std::size_t place(Rgb c) { return (std::size_t{c.r} << 16) | (std::size_t{c.g} << 8) | c.b; }
  std::vector<Rgb> colors_;
  std::vector<std::uint32_t> number_;  // by colour, from 1
};

}  // namespace

MeshFile read_3mf(const Source& source, const Context& context) { return ThreeMfReader(source, context).read(); }

void begin_3mf(ZipWriter& zip) {
  zip.add("[Content_Types].xml",
          R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)");
  zip.add("_rels/.rels",
          R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)");
}

// Why not lib3mf's writer: it prints six digits behind the point, whatever the size of the number (1e-7 becomes 0),
// puts random UUIDs into the file, and holds a second copy of the mesh.
void write_3mf(OutputFile& file, const MeshLayers& mesh, const Context& context) {
  if (mesh.vertices() > 0x7fffffffu)
    throw Error(Code::TooLarge, "a 3MF mesh has at most 2,147,483,647 vertices", "", "write .stl or .ply");
  ZipWriter zip(file);
  begin_3mf(zip);
  std::string begin = R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">Fibrolite</metadata>
<resources>
)";
  std::optional<Palette> palette;
  if (mesh.colored()) {
    palette.emplace(mesh, context.part(0, 0, ""));
    begin += "<basematerials id=\"2\">\n";
    for (const Rgb c : palette->colors()) begin += "<base name=\"" + hex(c) + "\" displaycolor=\"" + hex(c) + "\"/>\n";
    begin += "</basematerials>\n<object id=\"1\" type=\"model\" pid=\"2\" pindex=\"0\">\n";
  } else {
    begin += "<object id=\"1\" type=\"model\">\n";
  }
  zip.open(model_part_3mf);
  zip.append(deflate_piece(begin + "<mesh>\n<vertices>\n"));
  const auto vertex = [](std::string& text, Vec3f p) {
    text += "<vertex x=\"";
    append_number(text, p.x);
    text += "\" y=\"";
    append_number(text, p.y);
    text += "\" z=\"";
    append_number(text, p.z);
    text += "\"/>\n";
  };
  for_vertices(mesh, context.part(0, 0.4, ""), vertex, DeflateChunks{zip});
  zip.append(deflate_piece("</vertices>\n<triangles>\n"));
  const auto triangle = [&](std::string& text, const MeshLayer& layer, std::size_t t) {
    const auto& [a, b, c] = layer.triangles[t];
    text += "<triangle v1=\"";
    append_number(text, std::uint64_t{a});
    text += "\" v2=\"";
    append_number(text, std::uint64_t{b});
    text += "\" v3=\"";
    append_number(text, std::uint64_t{c});
    if (palette) {
      text += "\" pid=\"2\" p1=\"";
      append_number(text, std::uint64_t{palette->index(layer.colors[t])});
    }
    text += "\"/>\n";
  };
  for_triangles(mesh, context.part(0.4, 1, ""), triangle, DeflateChunks{zip});
  zip.append(deflate_piece(
      "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n"));
  zip.close();
  zip.finish();
}

}  // namespace fibrolite
