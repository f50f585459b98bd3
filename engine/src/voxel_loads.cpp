// SPDX-License-Identifier: Apache-2.0
#include "voxel_loads.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

Box3d node_box(const VoxelModel& model, std::size_t block) {
  const Vec3i o = model.origin[block];
  return {model.node_mm(o), model.node_mm({o.x + 8, o.y + 8, o.z + 8})};
}

std::string point(Vec3d p) {
  const auto text = [](double v) {
    std::string s = std::to_string(std::round(v * 100) / 100);
    return s.substr(0, s.find('.') + 3);
  };
  return "at " + text(p.x) + " " + text(p.y) + " " + text(p.z) + " mm";
}

}  // namespace

VoxelSupports voxel_supports(const VoxelModel& model, const std::vector<VoxelSupport>& supports) {
  if (supports.empty()) throw Error(Code::BadRecipe, "no support: the solid would fly away", "supports");
  std::vector<std::uint8_t> held(model.nodes(), 0);
  std::vector<double> value(3 * model.nodes(), 0.0);
  for (std::size_t s = 0; s < supports.size(); ++s) {
    const VoxelSupport& support = supports[s];
    bool any = false;
    std::vector<std::uint32_t> node;
    std::vector<Vec3d> at;
    std::vector<float> distance;
    for (std::size_t b = 0; b < model.blocks(); ++b) {
      if (support.where.bound(node_box(model, b)).lo > 0) continue;
      node.clear();
      at.clear();
      model.each_own_node(b, [&](std::uint32_t i, Vec3i n) {
        node.push_back(i);
        at.push_back(model.node_mm(n));
      });
      distance.resize(at.size());
      support.where.evaluate(at, distance);
      for (std::size_t k = 0; k < at.size(); ++k) {
        if (!(distance[k] < 0)) continue;
        any = true;
        const Vec3d u = support.displacement_mm ? support.displacement_mm(at[k]) : Vec3d{};
        for (int axis = 0; axis < 3; ++axis) {
          if (!support.axes[static_cast<std::size_t>(axis)]) continue;
          if (!std::isfinite(u[axis])) throw Error(Code::BadRecipe, "a prescribed displacement is not a number");
          held[node[k]] |= static_cast<std::uint8_t>(1U << axis);
          value[std::size_t{3} * node[k] + static_cast<std::size_t>(axis)] = u[axis];
        }
      }
    }
    if (!any) {
      throw Error(Code::BadRecipe, "support " + std::to_string(s + 1) + " touches no material", "supports",
                  "let it reach into the solid by a voxel");
    }
  }
  VoxelSupports result;
  for (std::size_t i = 0; i < 3 * model.nodes(); ++i) {
    if (((held[i / 3] >> (i % 3)) & 1U) == 0) continue;
    result.fixed.push_back(static_cast<std::uint32_t>(i));
    result.value_mm.push_back(value[i]);
  }
  return result;
}

void check_held(const VoxelModel& model, const VoxelPieces& pieces, const std::vector<std::uint32_t>& fixed) {
  std::vector<std::uint8_t> held(model.nodes(), 0);
  for (const std::uint32_t i : fixed) held[i / 3] |= static_cast<std::uint8_t>(1U << (i % 3));
  // For each piece: the sum over held components of r r^T, r the component's motion in six rigid motions about the
  // piece's first cell. Free motions are its null space.
  using Gram = Eigen::Matrix<double, 6, 6>;
  std::vector<Gram> gram(pieces.list.size(), Gram::Zero());
  std::vector<std::uint32_t> table(729);
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    bool any = false;
    for (std::uint32_t r = model.ref_begin[b]; r < model.ref_begin[b + 1]; ++r) any |= held[model.ref_node[r]] != 0;
    if (!any) continue;
    model.node_table(b, table.data());
    for (std::size_t c = 0; c < 512; ++c) {
      const std::uint32_t piece = pieces.of_cell[512 * b + c];
      if (piece == VoxelModel::none) continue;
      const int low = VoxelModel::lowest_corner(static_cast<int>(c));
      for (const int k : VoxelModel::corner) {
        const std::uint8_t mask = held[table[static_cast<std::size_t>(low + k)]];
        if (mask == 0) continue;
        const Vec3i n = model.node_at(b, low + k), o = pieces.list[piece].first;
        const double x = n.x - o.x, y = n.y - o.y, z = n.z - o.z;
        const std::array<std::array<double, 6>, 3> rows{
            {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}}};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (((mask >> axis) & 1U) == 0) continue;
          const Eigen::Map<const Eigen::Matrix<double, 6, 1>> r(rows[axis].data());
          gram[piece] += r * r.transpose();
        }
      }
    }
  }
  for (std::size_t p = 0; p < gram.size(); ++p) {
    const Vec3d at = model.centre_mm(pieces.list[p].first);
    const double count = gram[p].topLeftCorner<3, 3>().trace();
    if (!(count > 0)) {
      throw Error(Code::SolverFailed, "a loose piece of the solid is held by no support", point(at),
                  "remove it, join it or support it");
    }
    const double reach = std::max(1.0, std::sqrt(gram[p].bottomRightCorner<3, 3>().trace() / count));
    Eigen::Matrix<double, 6, 1> scale;
    scale << 1, 1, 1, 1 / reach, 1 / reach, 1 / reach;
    const Gram scaled = scale.asDiagonal() * gram[p] * scale.asDiagonal() / count;
    const Eigen::SelfAdjointEigenSolver<Gram> eigen(scaled);
    if (!(eigen.eigenvalues()[0] > 1e-9)) {
      throw Error(Code::SolverFailed, "the supports let a piece of the solid slide or turn freely", point(at),
                  "hold more of it, or along more axes");
    }
  }
}

namespace {

constexpr std::array<std::size_t, 3> step{64, 8, 1};

/// A face of a cell towards less material.
struct ExposedFace {
  double area = 0;  ///< In squares of the edge: the difference of the two fractions.
  std::array<std::uint32_t, 4> nodes{};
  std::size_t axis = 0;
  double sign = 1;       ///< Of its normal along the axis.
  std::size_t cell = 0;  ///< In its block.
};

/// visit(its centre, ExposedFace) for each of a block.
template <class Visit>
void each_exposed_face(const VoxelModel& model, std::size_t b, const std::uint32_t* table, const Visit& visit) {
  const float* fraction = model.fraction.data() + 512 * b;
  const Vec3i o = model.origin[b];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3i up = o, down = o;
    (axis == 0 ? up.x : axis == 1 ? up.y : up.z) += 8;
    (axis == 0 ? down.x : axis == 1 ? down.y : down.z) -= 8;
    const std::uint32_t above = model.find(up), below = model.find(down);
    for (std::size_t c = 0; c < 512; ++c) {
      const std::size_t at = (c / step[axis]) & 7U;
      const auto face = [&](bool high, float exposed) {
        if (!(exposed > 1e-6F)) return;
        const int low = VoxelModel::lowest_corner(static_cast<int>(c));
        ExposedFace out{.area = static_cast<double>(exposed), .axis = axis, .sign = high ? 1.0 : -1.0, .cell = c};
        std::size_t n = 0;
        for (std::size_t a = 0; a < 8; ++a) {
          if ((((a >> (2 - axis)) & 1U) != 0) == high) {
            out.nodes[n++] = table[static_cast<std::size_t>(low + VoxelModel::corner[a])];
          }
        }
        const Vec3i cell{o.x + static_cast<int>(c >> 6), o.y + static_cast<int>((c >> 3) & 7U),
                         o.z + static_cast<int>(c & 7U)};
        Vec3d centre = model.centre_mm(cell);
        const double half = (high ? 0.5 : -0.5) * model.edge_mm;
        (axis == 0 ? centre.x : axis == 1 ? centre.y : centre.z) += half;
        visit(centre, out);
      };
      const float here = fraction[c];
      if (!(here > 0)) continue;
      const float high_side = at < 7 ? fraction[c + step[axis]]
                              : above != VoxelModel::none
                                  ? model.fraction[std::size_t{512} * above + c - 7 * step[axis]]
                                  : 0;
      const float low_side = at > 0                      ? fraction[c - step[axis]]
                             : below != VoxelModel::none ? model.fraction[std::size_t{512} * below + c + 7 * step[axis]]
                                                         : 0;
      face(true, here - high_side);
      face(false, here - low_side);
    }
  }
}

/// visit(faces) once per block that reaches into `where`: the exposed faces with their centre in it, each area times
/// weight(face) and only if that is above 0.
template <class Weight, class Visit>
void each_block_of_faces(const VoxelModel& model, const Shape& where, const Weight& weight, const Visit& visit) {
  std::vector<std::uint32_t> table(729);
  std::vector<Vec3d> centre;
  std::vector<ExposedFace> faces;
  std::vector<float> distance;
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    if (where.bound(node_box(model, b)).lo > 0) continue;
    model.node_table(b, table.data());
    centre.clear();
    faces.clear();
    each_exposed_face(model, b, table.data(), [&](Vec3d at, ExposedFace face) {
      face.area *= weight(face);
      if (!(face.area > 1e-9)) return;
      centre.push_back(at);
      faces.push_back(face);
    });
    distance.resize(centre.size());
    where.evaluate(centre, distance);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < faces.size(); ++k) {
      if (distance[k] < 0) faces[kept++] = faces[k];
    }
    faces.resize(kept);
    visit(faces);
  }
}

void add_surface_force(const VoxelModel& model, const VoxelForce& force, std::size_t number, std::vector<double>& out) {
  std::vector<std::pair<std::uint32_t, double>> weights;
  double total = 0;
  const auto facing = [&](const ExposedFace& face) {
    return norm(force.facing) > 0 ? face.sign * force.facing[static_cast<int>(face.axis)] : 1;
  };
  each_block_of_faces(model, force.where, facing, [&](const std::vector<ExposedFace>& faces) {
    for (const ExposedFace& face : faces) {
      total += face.area;
      for (const std::uint32_t i : face.nodes) weights.emplace_back(i, 0.25 * face.area);
    }
  });
  if (!(total > 0)) {
    throw Error(Code::BadRecipe, "load " + std::to_string(number + 1) + " meets no material", "forces",
                "let it reach over the surface");
  }
  for (const auto& [i, w] : weights) {
    for (int axis = 0; axis < 3; ++axis) {
      out[std::size_t{3} * i + static_cast<std::size_t>(axis)] += w / total * force.total_n[axis];
    }
  }
}

/// Returns the magnitude: the faces of one cell are the steps of one plane, so their forces add up as vectors.
double add_pressure(const VoxelModel& model, const VoxelPressure& pressure, std::size_t number,
                    std::vector<double>& out) {
  const double on_node_n = 0.25 * pressure.mpa * model.edge_mm * model.edge_mm;  // of a whole face
  double magnitude_n = 0;
  const auto all = [](const ExposedFace&) { return 1.0; };
  each_block_of_faces(model, pressure.where, all, [&](const std::vector<ExposedFace>& faces) {
    std::array<Vec3d, 512> of_cell{};
    for (const ExposedFace& face : faces) {
      const double force_n = -face.sign * face.area * on_node_n;
      Vec3d& sum = of_cell[face.cell];
      (face.axis == 0 ? sum.x : face.axis == 1 ? sum.y : sum.z) += 4 * force_n;
      for (const std::uint32_t i : face.nodes) out[std::size_t{3} * i + face.axis] += force_n;
    }
    for (const Vec3d v : of_cell) magnitude_n += norm(v);
  });
  if (!(magnitude_n > 0)) {
    throw Error(Code::BadRecipe, "pressure " + std::to_string(number + 1) + " meets no material", "pressures",
                "let it reach over the surface");
  }
  return magnitude_n;
}

/// Two-point Gauss rule per axis: exact for a force that is linear in a cell.
void add_body_force(const VoxelModel& model, const std::function<Vec3d(Vec3d)>& force, std::vector<double>& out) {
  std::vector<std::uint32_t> table(729);
  const double h = model.edge_mm, volume = h * h * h, gauss = 0.5 / std::sqrt(3.0);
  for (std::size_t b = 0; b < model.blocks(); ++b) {
    model.node_table(b, table.data());
    for (std::size_t c = 0; c < 512; ++c) {
      const auto f = static_cast<double>(model.fraction[512 * b + c]);
      if (!(f > 0)) continue;
      const int low = VoxelModel::lowest_corner(static_cast<int>(c));
      const Vec3d centre = model.node_mm(model.node_at(b, low)) + Vec3d{0.5 * h, 0.5 * h, 0.5 * h};
      for (unsigned q = 0; q < 8; ++q) {
        const std::array<double, 3> s{(q & 4U) != 0 ? gauss : -gauss, (q & 2U) != 0 ? gauss : -gauss,
                                      (q & 1U) != 0 ? gauss : -gauss};
        const Vec3d v = force(centre + h * Vec3d{s[0], s[1], s[2]});
        for (unsigned a = 0; a < 8; ++a) {
          double shape = f * volume / 8;
          for (unsigned k = 0; k < 3; ++k) shape *= 0.5 + (((a >> (2 - k)) & 1U) != 0 ? s[k] : -s[k]);
          const std::size_t i = table[static_cast<std::size_t>(low + VoxelModel::corner[a])];
          for (int axis = 0; axis < 3; ++axis) out[3 * i + static_cast<std::size_t>(axis)] += shape * v[axis];
        }
      }
    }
  }
}

}  // namespace

VoxelForces voxel_forces(const VoxelModel& model, const VoxelFemProblem& problem) {
  VoxelForces forces;
  std::vector<double>& out = forces.node_n;
  out.assign(3 * model.nodes(), 0.0);
  for (std::size_t i = 0; i < problem.forces.size(); ++i) add_surface_force(model, problem.forces[i], i, out);
  for (std::size_t i = 0; i < problem.pressures.size(); ++i)
    forces.pressed_n += add_pressure(model, problem.pressures[i], i, out);
  if (problem.body_force_n_mm3) add_body_force(model, problem.body_force_n_mm3, out);
  for (const double v : out) {
    if (!std::isfinite(v)) throw Error(Code::BadRecipe, "a load is not a number", "forces");
  }
  return forces;
}

}  // namespace fibrolite
