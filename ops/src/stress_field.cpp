// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/stress_field.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <type_traits>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "fibrolite/vtu.h"

namespace fibrolite {
namespace {

Eigen::Matrix3d matrix(const StressTensor& s) {
  Eigen::Matrix3d m;
  m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return m;
}

/// The frame's axes as columns: turns its coordinates into the world's.
Eigen::Matrix3d rotation(const Frame& f) {
  Eigen::Matrix3d r;
  r << f.x.x, f.y.x, f.z.x, f.x.y, f.y.y, f.z.y, f.x.z, f.y.z, f.z.z;
  return r;
}

/// Text of a deck, by the line; numbers with the fewest digits that read back the same.
class Deck {
 public:
  explicit Deck(const std::filesystem::path& path) : file_(path) {}
  /// Cells with commas between them.
  template <class... Cells>
  void row(const Cells&... cells) {
    ((put(cells), buffer_.push_back(',')), ...);
    end_row();
  }
  void put_cell(std::uint32_t number) {
    put(number);
    buffer_.push_back(',');
  }
  void end_row() {
    buffer_.back() = '\n';
    if (buffer_.size() > 1 << 20) flush();
  }
  void finish() {
    flush();
    file_.commit();
  }

 private:
  void put(std::string_view text) { buffer_.append(text); }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    buffer_.append(text.data(), static_cast<std::size_t>(end - text.data()));
    // A deck's real numbers have a point or an exponent.
    if (std::is_floating_point_v<Number> &&
        std::find_if(text.data(), end, [](char c) { return c == '.' || c == 'e'; }) == end)
      buffer_.push_back('.');
  }
  void flush() {
    file_.write(buffer_);
    buffer_.clear();
  }
  OutputFile file_;
  std::string buffer_;
};

/// A node held fast is so in any frame; one that slides only along the deck's own axes.
void check_axes(const StressField& field, const StressField::Case& load) {
  if (load.held_in.x == Vec3d{1, 0, 0} && load.held_in.y == Vec3d{0, 1, 0}) return;
  std::vector<int> axes(field.mesh.nodes.size(), 0);
  for (const StressField::Fixed& f : load.fixed) ++axes[f.node];
  if (std::any_of(axes.begin(), axes.end(), [](int n) { return n == 1 || n == 2; }))
    throw Error(Code::Unsupported, "a support slides askew to the deck's axes", load.name,
                "turn the model so that it stands along x, y or z, or hold it fast");
}

}  // namespace

void write_vtu(const std::filesystem::path& path, const StressField& field, const Context& context) {
  TetMesh world = field.mesh;
  for (Vec3d& p : world.nodes) p = field.frame.to_world(p);
  const Eigen::Matrix3d turn = rotation(field.frame);
  std::vector<VtuField> nodes;
  for (const StressField::Case& load : field.cases) {
    context.check();
    VtuField displacement{"displacement_mm " + load.name, 3, {}}, stress{"stress_mpa " + load.name, 6, {}},
        mises{"von_mises_mpa " + load.name, 1, {}}, principal{"principal_mpa " + load.name, 3, {}};
    for (const Vec3d u : load.displacement_mm) {
      const Vec3d w = u.x * field.frame.x + u.y * field.frame.y + u.z * field.frame.z;
      displacement.values.insert(displacement.values.end(), {w.x, w.y, w.z});
    }
    for (const StressTensor& s : load.stress_mpa) {
      const Eigen::Matrix3d w = turn * matrix(s) * turn.transpose();
      stress.values.insert(stress.values.end(), {w(0, 0), w(1, 1), w(2, 2), w(0, 1), w(1, 2), w(0, 2)});
      mises.values.push_back(von_mises(s));
      const auto p = principal_stresses(s);
      principal.values.insert(principal.values.end(), p.begin(), p.end());
    }
    for (VtuField* made : {&displacement, &stress, &mises, &principal}) nodes.push_back(std::move(*made));
  }
  VtuField part{"part", 1, {field.part.begin(), field.part.end()}};
  write_vtu(path, world, nodes, {part}, context);
}

void write_inp(const std::filesystem::path& path, const StressField& field, const Context& context) {
  Deck deck(path);
  deck.row("** Fibrolite: the body taken as solid; N, mm, MPa");
  deck.row("*NODE", "NSET=ALL");
  for (std::uint32_t n = 0; n < field.mesh.nodes.size(); ++n) {
    const Vec3d p = field.mesh.nodes[n];
    deck.row(n + 1, p.x, p.y, p.z);
  }
  context.check();
  const int highest = field.part.empty() ? -1 : *std::max_element(field.part.begin(), field.part.end());
  const auto set_of = [](int part) { return std::string("PART_").append(std::to_string(part)); };
  for (int part = 0; part <= highest; ++part) {
    deck.row("*ELEMENT", "TYPE=C3D10", "ELSET=" + set_of(part));
    for (std::uint32_t t = 0; t < field.mesh.tets.size(); ++t) {
      if (field.part[t] != part) continue;
      deck.put_cell(t + 1);
      for (const std::uint32_t n : field.mesh.tets[t]) deck.put_cell(n + 1);  // the deck's order of nodes is ours
      deck.end_row();
    }
  }
  deck.row("*ELSET", "ELSET=BODY");
  for (int part = 0; part <= highest; ++part) deck.row(set_of(part));
  deck.row("*MATERIAL", "NAME=SOLID");
  deck.row("*ELASTIC");
  deck.row(field.material.young_mpa, field.material.poisson);
  deck.row("*SOLID SECTION", "ELSET=BODY", "MATERIAL=SOLID");
  for (const StressField::Case& load : field.cases) {
    context.check();
    deck.row("** load case: " + load.name);
    deck.row("*STEP");
    deck.row("*STATIC");
    check_axes(field, load);
    deck.row("*BOUNDARY", "OP=NEW");
    for (const StressField::Fixed& f : load.fixed) deck.row(f.node + 1, f.axis + 1, f.axis + 1);
    deck.row("*CLOAD", "OP=NEW");
    for (std::uint32_t n = 0; n < load.force_n.size(); ++n) {
      for (int axis = 0; axis < 3; ++axis) {
        const double force = load.force_n[n][axis];
        if (force != 0) deck.row(n + 1, axis + 1, force);
      }
    }
    for (const char* line : {"*NODE PRINT, NSET=ALL", "U", "*EL PRINT, ELSET=BODY", "S", "*END STEP"}) deck.row(line);
  }
  deck.finish();
}

}  // namespace fibrolite
