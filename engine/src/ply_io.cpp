// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "fibrolite/error.h"
#include "mesh_formats.h"

namespace fibrolite {
namespace {

enum class Type { I8, U8, I16, U16, I32, U32, F32, F64 };

constexpr std::size_t size_of(Type type) {
  switch (type) {
    case Type::I8:
    case Type::U8:
      return 1;
    case Type::I16:
    case Type::U16:
      return 2;
    case Type::I32:
    case Type::U32:
    case Type::F32:
      return 4;
    case Type::F64:
      break;
  }
  return 8;
}

std::optional<Type> parse_type(std::string_view name) {
  struct Name {
    std::string_view text;
    Type type;
  };
  constexpr std::array names{
      Name{"char", Type::I8},   Name{"int8", Type::I8},     Name{"uchar", Type::U8},   Name{"uint8", Type::U8},
      Name{"short", Type::I16}, Name{"int16", Type::I16},   Name{"ushort", Type::U16}, Name{"uint16", Type::U16},
      Name{"int", Type::I32},   Name{"int32", Type::I32},   Name{"uint", Type::U32},   Name{"uint32", Type::U32},
      Name{"float", Type::F32}, Name{"float32", Type::F32}, Name{"double", Type::F64}, Name{"float64", Type::F64}};
  for (const Name& n : names)
    if (n.text == name) return n.type;
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type = Type::F32;
  std::optional<Type> list_count;  // set for lists
};
struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] std::optional<std::size_t> find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
      if (properties[i].name == property) return i;
    return std::nullopt;
  }
};
enum class Encoding { Ascii, Little, Big };
struct Header {
  Encoding encoding = Encoding::Ascii;
  std::vector<Element> elements;
  std::size_t end = 0;  // first byte of the data
};

Type type_word(TextCursor& cursor) {
  const std::string_view word = cursor.skip_blanks() ? cursor.word() : std::string_view{};
  const std::optional<Type> type = parse_type(word);
  if (!type) cursor.fail_here("unknown type " + shown(word));
  return *type;
}

Property read_property(TextCursor& cursor) {
  Property property;
  TextCursor ahead = cursor;
  if (ahead.word() == "list") {
    cursor = ahead;
    property.list_count = type_word(cursor);
    if (*property.list_count == Type::F32 || *property.list_count == Type::F64)
      cursor.fail_here("a list counted by fractions");
  }
  property.type = type_word(cursor);
  if (cursor.skip_blanks()) property.name = cursor.word();
  return property;
}

Header read_header(const Source& source) {
  Header header;
  TextCursor cursor(source);
  if (cursor.word() != "ply") fail_at(source, 0, "the first word is not 'ply'", "is it a PLY file?");
  bool has_format = false;
  for (;;) {
    cursor.next_line();
    if (!cursor.skip_space()) cursor.fail_here("the header has no end", "is the file truncated?");
    const std::size_t at = cursor.position();
    const std::string_view keyword = cursor.word();
    if (keyword == "format") {
      const std::string_view name = cursor.word();
      if (name == "ascii")
        header.encoding = Encoding::Ascii;
      else if (name == "binary_little_endian")
        header.encoding = Encoding::Little;
      else if (name == "binary_big_endian")
        header.encoding = Encoding::Big;
      else
        fail_at(source, at, "unknown format " + shown(name));
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = cursor.word();
      const std::int64_t count = cursor.integer("number of elements");
      if (count < 0) fail_at(source, at, "a negative number of elements");
      element.count = static_cast<std::size_t>(count);
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) fail_at(source, at, "a property before any element");
      header.elements.back().properties.push_back(read_property(cursor));
    } else if (keyword == "end_header") {
      if (!has_format) fail_at(source, at, "the header does not say its format");
      cursor.next_line();
      header.end = cursor.position();
      return header;
    } else if (keyword != "comment" && keyword != "obj_info") {
      fail_at(source, at, "unknown header line " + shown(keyword));
    }
  }
}

// Values as text.
class AsciiValues {
 public:
  AsciiValues(const Source& source, std::size_t begin) : cursor_(source, begin), size_(source.bytes.size()) {}
  float coordinate(Type) { return cursor_.number("coordinate"); }
  std::int64_t integer(Type type) {
    if (type != Type::F32 && type != Type::F64) return cursor_.integer("index");
    const float value = cursor_.number("index");
    if (value != std::floor(value) || std::abs(value) > 16777216.0f) cursor_.fail_here("a fraction as an index");
    return static_cast<std::int64_t>(value);
  }
  void skip(Type) {
    if (cursor_.word().empty()) cursor_.fail_here("the file ends too early", "it is truncated");
  }
  [[nodiscard]] std::size_t bytes_left() const { return size_ - std::min(size_, cursor_.position()); }
  static std::size_t least_bytes(Type) { return 2; }  // a digit and a blank
  [[noreturn]] void fail_here(const std::string& what, const std::string& hint = {}) const {
    cursor_.fail_here(what, hint);
  }

 private:
  TextCursor cursor_;
  std::size_t size_;
};

// Values as the machine holds them, or with their bytes the other way round.
class BinaryValues {
 public:
  BinaryValues(const Source& source, std::size_t begin, bool swap) : source_(source), at_(begin), swap_(swap) {}
  float coordinate(Type type) {
    const double value = number(type);
    const auto narrow = static_cast<float>(value);
    if (!std::isfinite(narrow)) fail_here("NaN, infinite or too large coordinate");
    return narrow;
  }
  std::int64_t integer(Type type) {
    const double value = number(type);
    if (!(std::abs(value) <= 9e15) || value != std::floor(value)) fail_here("not a whole number as index");
    return static_cast<std::int64_t>(value);
  }
  void skip(Type type) {
    need(size_of(type));
    at_ += size_of(type);
  }
  [[nodiscard]] std::size_t bytes_left() const { return source_.bytes.size() - at_; }
  static std::size_t least_bytes(Type type) { return size_of(type); }
  [[noreturn]] void fail_here(const std::string& what, const std::string& hint = {}) const {
    fail(source_, what, "byte " + std::to_string(at_), hint);
  }

 private:
  void need(std::size_t size) const {
    if (bytes_left() < size) fail_here("the file ends too early", "it is truncated");
  }
  // Every type but none wider than 53 bits fits a double exactly.
  double number(Type type) {
    switch (type) {
      case Type::I8:
        return take<std::int8_t>();
      case Type::U8:
        return take<std::uint8_t>();
      case Type::I16:
        return take<std::int16_t>();
      case Type::U16:
        return take<std::uint16_t>();
      case Type::I32:
        return take<std::int32_t>();
      case Type::U32:
        return take<std::uint32_t>();
      case Type::F32:
        return double{take<float>()};
      case Type::F64:
        break;
    }
    return take<double>();
  }
  template <class T>
  T take() {
    need(sizeof(T));
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), source_.bytes.data() + at_, sizeof(T));
    if (swap_) std::reverse(bytes.begin(), bytes.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(bytes);
  }

  const Source& source_;
  std::size_t at_;
  bool swap_;
};

template <class Values>
class PlyBody {
 public:
  PlyBody(const Header& header, Values values, const Context& context)
      : header_(header), values_(std::move(values)), context_(context) {}

  MeshFile read() {
    for (const Element& element : header_.elements)
      if (element.name == "vertex") vertex_count_ = element.count;
    for (const Element& element : header_.elements) {
      if (element.properties.empty()) continue;
      expect_room(element);
      if (element.name == "vertex")
        vertices(element);
      else if (element.name == "face")
        faces(element);
      else
        for_each(element, [&](std::size_t) { return false; });
    }
    sink_.finish();
    return std::move(file_);
  }

 private:
  // A wild count must not ask for memory: each element takes some bytes.
  void expect_room(const Element& element) const {
    std::size_t least = 0;
    for (const Property& p : element.properties) least += Values::least_bytes(p.list_count.value_or(p.type));
    if (element.count > (values_.bytes_left() + 1) / least)
      values_.fail_here("the header promises " + std::to_string(element.count) + " elements '" + element.name +
                            "', more than the file can hold",
                        "it is truncated");
    if (element.count > 0xffffffffu) values_.fail_here("over 4,294,967,295 elements '" + element.name + "'");
  }

  std::size_t list_size(const Property& property) {
    const std::int64_t n = values_.integer(*property.list_count);
    if (n < 0 || static_cast<std::size_t>(n) > (values_.bytes_left() + 1) / Values::least_bytes(property.type))
      values_.fail_here("a list of " + std::to_string(n) + " values, more than the file can hold", "it is damaged");
    return static_cast<std::size_t>(n);
  }

  // Calls `take(property)`; what it does not take (it returns false) is skipped.
  template <class Take>
  void for_each(const Element& element, const Take& take, const auto& after) {
    for (std::size_t i = 0; i < element.count; ++i) {
      if (i % 65536 == 0) context_.check();
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (take(p)) continue;
        const Property& property = element.properties[p];
        const std::size_t n = property.list_count ? list_size(property) : 1;
        for (std::size_t k = 0; k < n; ++k) values_.skip(property.type);
      }
      after();
    }
  }
  template <class Take>
  void for_each(const Element& element, const Take& take) {
    for_each(element, take, [] {});
  }

  void vertices(const Element& element) {
    const auto x = element.find("x"), y = element.find("y"), z = element.find("z");
    if (!x || !y || !z) values_.fail_here("the vertices have no x, y and z");
    for (const std::size_t i : {*x, *y, *z})
      if (element.properties[i].list_count) values_.fail_here("a vertex coordinate is a list");
    file_.mesh.vertices.reserve(element.count);
    Vec3f point;
    for_each(
        element,
        [&](std::size_t p) {
          float* const target = p == *x ? &point.x : p == *y ? &point.y : p == *z ? &point.z : nullptr;
          if (target == nullptr) return false;
          *target = values_.coordinate(element.properties[p].type);
          return true;
        },
        [&] { file_.mesh.vertices.push_back(point); });
  }

  void faces(const Element& element) {
    auto list = element.find("vertex_indices");
    if (!list) list = element.find("vertex_index");
    if (!list || !element.properties[*list].list_count) values_.fail_here("the faces have no list 'vertex_indices'");
    const auto red = element.find("red"), green = element.find("green"), blue = element.find("blue");
    const auto is_color = [&](std::optional<std::size_t> p) {
      return p && !element.properties[*p].list_count && element.properties[*p].type == Type::U8;
    };
    const bool colored = is_color(red) && is_color(green) && is_color(blue);
    std::vector<std::uint32_t> corners;
    Rgb color;
    for_each(
        element,
        [&](std::size_t p) {
          if (p == *list) {
            read_corners(element.properties[p], corners);
            return true;
          }
          std::uint8_t* const target = !colored      ? nullptr
                                       : p == *red   ? &color.r
                                       : p == *green ? &color.g
                                       : p == *blue  ? &color.b
                                                     : nullptr;
          if (target == nullptr) return false;
          *target = static_cast<std::uint8_t>(values_.integer(Type::U8));
          return true;
        },
        [&] {
          const std::size_t added = sink_.add(corners);
          if (colored) file_.mesh.triangle_colors.insert(file_.mesh.triangle_colors.end(), added, color);
        });
  }

  void read_corners(const Property& list, std::vector<std::uint32_t>& corners) {
    const std::size_t n = list_size(list);
    corners.clear();
    for (std::size_t k = 0; k < n; ++k) {
      const std::int64_t index = values_.integer(list.type);
      if (index < 0 || index >= static_cast<std::int64_t>(vertex_count_))
        values_.fail_here("vertex index " + std::to_string(index) + " is out of range: the file has " +
                          std::to_string(vertex_count_) + " vertices");
      corners.push_back(static_cast<std::uint32_t>(index));
    }
  }

  const Header& header_;
  Values values_;
  const Context& context_;
  MeshFile file_;
  PolygonSink sink_{file_};
  std::size_t vertex_count_ = 0;
};

}  // namespace

MeshFile read_ply(const Source& source, const Context& context) {
  const Header header = read_header(source);
  const auto has = [&](std::string_view name) {
    return std::any_of(header.elements.begin(), header.elements.end(),
                       [&](const Element& e) { return e.name == name; });
  };
  if (!has("vertex")) fail(source, "the file has no element 'vertex'", "header");
  if (!has("face")) {
    if (has("tristrips"))
      throw Error(Code::Unsupported, "triangle strips are not read", source.name, "save the model with faces");
    fail(source, "the model has no triangles", "header", "is it a point cloud?");
  }
  if (header.encoding == Encoding::Ascii) return PlyBody(header, AsciiValues(source, header.end), context).read();
  return PlyBody(header, BinaryValues(source, header.end, header.encoding == Encoding::Big), context).read();
}

void write_ply(OutputFile& file, const MeshLayers& mesh, const Context& context) {
  const bool colored = mesh.colored();
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment Millimetres, by Fibrolite\nelement vertex ";
  header += std::to_string(mesh.vertices()) + "\nproperty float x\nproperty float y\nproperty float z\nelement face ";
  header += std::to_string(mesh.triangles()) + "\nproperty list uchar uint vertex_indices\n";
  if (colored) header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  file.write(header + "end_header\n");
  const auto vertex = [](std::string& text, Vec3f p) { append_bytes(text, p); };
  for_vertices(mesh, context.part(0, 0.4, ""), vertex, WriteChunks{file});
  const auto face = [colored](std::string& text, const MeshLayer& layer, std::size_t t) {
    text += '\3';
    append_bytes(text, layer.triangles[t]);
    if (colored) append_bytes(text, layer.colors[t]);
  };
  for_triangles(mesh, context.part(0.4, 1, ""), face, WriteChunks{file});
}

}  // namespace fibrolite
