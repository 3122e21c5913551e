#include "common/geometry/implicit/polygonise.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace phantom::geometry {
namespace {

constexpr int kBrick = 8;  // cells along a brick; a brick's corners are sampled at once
constexpr int kCorners = kBrick + 1;
constexpr std::size_t kBrickCorners = kCorners * kCorners * kCorners;
constexpr int kBisections = 14;
constexpr int kThinDepth = 7;   // walls as thin as 1/128 of a cell are found along an edge
constexpr double kReach = 0.6;  // how far, in cells, a vertex may lie outside its own cell
using Cell = std::array<int, 3>;

/// A point where an edge crosses the surface, and the outward normal there.
struct Crossing {
  Eigen::Vector3d p_m, normal;
};

class Polygoniser {
 public:
  Polygoniser(const ImplicitSolid& solid, const Box& box, int cells, core::WorkBudget* budget)
      : solid_(&solid), cells_(cells), meter_(budget) {
    edge_m_ = box.size_m().maxCoeff() / cells;
    // An uneven margin, so that faces of the box do not coincide with samples.
    origin_m_ = box.min_m - Eigen::Vector3d::Constant(1.37 * edge_m_);
    int longest = 0;
    for (int axis = 0; axis < 3; ++axis)
      longest = std::max(longest, static_cast<int>(std::ceil(box.size_m()[axis] / edge_m_)) + 3);
    root_ = kBrick;
    while (root_ < longest) root_ *= 2;
    for (int axis = 0; axis < 3; ++axis)
      size_[static_cast<std::size_t>(axis)] = static_cast<int>(std::ceil(box.size_m()[axis] / edge_m_)) + 3;
  }

  Polygonised run() {
    visit({0, 0, 0}, root_);
    if (ended_) return {};
    for (const auto& [cell, axis, outwards] : crossed_edges_) emit(cell, axis, outwards);
    return {std::move(mesh_), cells_, few(thin_places_)};
  }
  /// Returns whether two sheets of the surface pass through one cell in a few places at most.
  bool sheets_are_apart() const { return few(meetings_); }

 private:
  struct CrossedEdge {
    Cell corner;
    int axis;
    bool outwards;  // inside at the corner, outside at the other end
  };

  // What is known of the brick of this number, of one of its corners and of an edge from there.
  struct BrickCorner {
    std::uint32_t brick = 0;
    bool inside = false;
  };
  struct BrickEdge {
    std::uint32_t brick = 0;
    Crossing crossing;
  };

  /// Returns whether so few places are acceptable: the rims of wedges are thin, too, and finer cells do not
  /// change that.
  bool few(std::size_t places) const {
    return places <= std::max(static_cast<std::size_t>(cells_ / 8), crossed_edges_.size() / 500);
  }
  Eigen::Vector3d corner_m(const Cell& c) const {
    return origin_m_ + edge_m_ * Eigen::Vector3d(c[0], c[1], c[2]);
  }
  /// Counts so many evaluations; once there may be no more, they are left out and the mesh is dropped.
  bool spend(std::uint64_t evaluations) {
    if (!ended_) ended_ = !meter_.spend(evaluations * solid_->steps());
    return !ended_;
  }
  bool inside(const Eigen::Vector3d& p) { return spend(1) && solid_->value(p) < 0.0; }
  static std::uint64_t key(const Cell& c) {
    return static_cast<std::uint64_t>(c[0]) | static_cast<std::uint64_t>(c[1]) << 21 |
           static_cast<std::uint64_t>(c[2]) << 42;
  }

  void visit(const Cell& first, int size) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (first[axis] >= size_[axis]) return;
    }
    if (!spend(1)) return;
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * size * edge_m_);
    const Interval bounds = solid_->bounds(Region::box(corner_m(first) + half, half));
    if (bounds.lo >= 0.0 || bounds.hi < 0.0) return;
    if (size == kBrick) {
      if (!spend(2)) return;
      // Normals are sampled slightly beyond the brick.
      const ImplicitPtr fewer = solid_->within(Region::box(corner_m(first) + half, 1.01 * half));
      const ImplicitSolid* const whole = std::exchange(solid_, fewer ? fewer.get() : solid_);
      sample(first);
      solid_ = whole;
      return;
    }
    for (int i = 0; i < 8; ++i)
      visit(
          {first[0] + (i & 1) * size / 2, first[1] + (i >> 1 & 1) * size / 2, first[2] + (i >> 2) * size / 2},
          size / 2);
  }

  static std::size_t index_in_brick(int x, int y, int z) {
    return static_cast<std::size_t>((z * kCorners + y) * kCorners + x);
  }

  /// Marks the cells of a brick through which the surface may pass: of `size` cells along each axis from
  /// `from`, cells of the brick at `first`.
  void mark(const Cell& first, const Cell& from, int size) {
    if (!spend(1)) return;
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * size * edge_m_);
    const Interval bounds = solid_->bounds(
        Region::box(corner_m({first[0] + from[0], first[1] + from[1], first[2] + from[2]}) + half, half));
    if (bounds.lo >= 0.0 || bounds.hi < 0.0) return;
    if (size == 1) {
      marked_[index_in_brick(from[0], from[1], from[2])] = true;
      return;
    }
    const int step = size / 2;
    for (int i = 0; i < 8; ++i)
      mark(first, {from[0] + (i & 1) * step, from[1] + (i >> 1 & 1) * step, from[2] + (i >> 2) * step}, step);
  }

  void sample(const Cell& first) {
    ++brick_;
    marked_.fill(false);
    mark(first, {0, 0, 0}, kBrick);
    for (int z = 0; z < kBrick; ++z) {
      for (int y = 0; y < kBrick; ++y) {
        for (int x = 0; x < kBrick; ++x) {
          if (ended_) return;
          if (marked_[index_in_brick(x, y, z)])
            sample_cell(first, {first[0] + x, first[1] + y, first[2] + z});
        }
      }
    }
  }

  void sample_cell(const Cell& first, const Cell& cell) {
    std::array<bool, 8> corners;
    for (int i = 0; i < 8; ++i) {
      const Cell corner{cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2)};
      BrickCorner& sampled =
          corners_[index_in_brick(corner[0] - first[0], corner[1] - first[1], corner[2] - first[2])];
      if (sampled.brick != brick_) sampled = {brick_, inside(corner_m(corner))};
      corners[static_cast<std::size_t>(i)] = sampled.inside;
    }
    for (int axis = 0; axis < 3; ++axis)
      look_along_edge(cell, axis, corners[0], corners[std::size_t{1} << axis]);
    meetings_ += sheets_meet(corners);
    if (std::any_of(corners.begin(), corners.end(), [&](bool c) { return c != corners[0]; }))
      add_vertex(first, cell, corners);
  }

  /// Returns whether two sheets pass through the cell: one of the faces at its lower corner has its two
  /// diagonals on different sides of the surface.
  static bool sheets_meet(const std::array<bool, 8>& c) {
    const auto crossed = [&](std::size_t a, std::size_t b) {
      return c[0] == c[a | b] && c[a] == c[b] && c[0] != c[a];
    };
    return crossed(1, 2) || crossed(2, 4) || crossed(4, 1);
  }

  void look_along_edge(const Cell& corner, int axis, bool from_inside, bool to_inside) {
    if (from_inside != to_inside) return crossed_edges_.push_back({corner, axis, from_inside});
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    step[axis] = edge_m_;
    const Eigen::Vector3d from = corner_m(corner);
    const auto other = find_other_side(from, from + step, from_inside, kThinDepth);
    if (!other) return;
    // There are two crossings on one edge. An edge or corner of the solid that intrudes is acceptable, a thin
    // wall or gap is not.
    const Crossing one = cross(from, *other), two = cross(from + step, *other);
    thin_places_ += one.normal.dot(two.normal) < -0.9;
  }

  /// Finds a point on the other side of the surface between two points on the same side.
  std::optional<Eigen::Vector3d> find_other_side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, bool in,
                                                 int depth) {
    if (!spend(1)) return std::nullopt;
    const Eigen::Vector3d middle = 0.5 * (a + b);
    const Interval bounds = solid_->bounds(Region::box(middle, 0.5 * (b - a).cwiseAbs()));
    if (bounds.lo >= 0.0 || bounds.hi < 0.0) return std::nullopt;
    if (inside(middle) != in) return middle;
    if (depth == 0) return std::nullopt;
    if (auto found = find_other_side(a, middle, in, depth - 1)) return found;
    return find_other_side(middle, b, in, depth - 1);
  }

  /// Finds the crossing of the surface between two points on different sides.
  Crossing cross(Eigen::Vector3d a, Eigen::Vector3d b) {
    const bool a_inside = inside(a);
    for (int i = 0; i < kBisections; ++i) {
      const Eigen::Vector3d middle = 0.5 * (a + b);
      (inside(middle) == a_inside ? a : b) = middle;
    }
    Crossing crossing{0.5 * (a + b), Eigen::Vector3d::Zero()};
    if (!spend(6)) return crossing;
    const double h = 1e-3 * edge_m_;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d step = Eigen::Vector3d::Zero();
      step[axis] = h;
      crossing.normal[axis] = solid_->value(crossing.p_m + step) - solid_->value(crossing.p_m - step);
    }
    const double norm = crossing.normal.norm();
    crossing.normal =
        norm > 0.0 && std::isfinite(norm) ? Eigen::Vector3d(crossing.normal / norm) : Eigen::Vector3d::Zero();
    return crossing;
  }

  /// Returns the crossing of a crossed edge of the brick at `first`, which up to four of its cells share.
  const Crossing& crossing_of(const Cell& first, const Cell& corner, int axis) {
    const std::size_t at = index_in_brick(corner[0] - first[0], corner[1] - first[1], corner[2] - first[2]);
    BrickEdge& edge = edges_[3 * at + static_cast<std::size_t>(axis)];
    if (edge.brick == brick_) return edge.crossing;
    Cell end = corner;
    ++end[static_cast<std::size_t>(axis)];
    edge = {brick_, cross(corner_m(corner), corner_m(end))};
    return edge.crossing;
  }

  /// Adds the cell's vertex: the point nearest to all tangent planes at the cell's crossings. It lies on an
  /// edge or a corner if the planes meet in one.
  void add_vertex(const Cell& first, const Cell& cell, const std::array<bool, 8>& corners) {
    std::array<Crossing, 12> crossings;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = i | std::size_t{1} << axis;
        if (j == i || corners[i] == corners[j]) continue;
        const Cell corner{cell[0] + static_cast<int>(i & 1), cell[1] + static_cast<int>(i >> 1 & 1),
                          cell[2] + static_cast<int>(i >> 2)};
        crossings[count++] = crossing_of(first, corner, static_cast<int>(axis));
      }
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) middle += crossings[i].p_m / static_cast<double>(count);
    Eigen::Matrix3d planes = Eigen::Matrix3d::Zero();
    Eigen::Vector3d wanted = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [p_m, normal] = crossings[i];
      planes += normal * normal.transpose();
      wanted += normal * normal.dot(p_m - middle);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(planes);
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      const double weight = solver.eigenvalues()[i];
      // Directions that the planes hardly constrain keep the middle.
      if (weight > 0.05 * solver.eigenvalues()[2] && weight > 0.0) {
        const Eigen::Vector3d direction = solver.eigenvectors().col(i);
        offset += direction * (direction.dot(wanted) / weight);
      }
    }
    // An edge or a corner may extend into the next cell without being detected there, so the vertex may lie
    // slightly outside its cell.
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kReach * edge_m_);
    const Eigen::Vector3d low = corner_m(cell) - reach,
                          high = corner_m({cell[0] + 1, cell[1] + 1, cell[2] + 1}) + reach;
    const Eigen::Vector3d p = (middle + offset).cwiseMax(low).cwiseMin(high);
    vertex_of_[key(cell)] = static_cast<std::uint32_t>(mesh_.vertices_m.size());
    mesh_.vertices_m.push_back(p.cast<float>());
  }

  /// Adds a quadrilateral through the vertices of the four cells around a crossed edge.
  void emit(const Cell& corner, int axis, bool outwards) {
    const auto u = static_cast<std::size_t>((axis + 1) % 3), v = static_cast<std::size_t>((axis + 2) % 3);
    std::array<std::uint32_t, 4> q;
    constexpr int kAround[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    for (std::size_t i = 0; i < 4; ++i) {
      Cell cell = corner;
      cell[u] += kAround[i][0];
      cell[v] += kAround[i][1];
      q[i] = vertex_of_.at(key(cell));
    }
    if (!outwards) std::swap(q[1], q[3]);
    const auto far = [&](std::size_t i, std::size_t j) {
      return (mesh_.vertices_m[q[i]] - mesh_.vertices_m[q[j]]).squaredNorm();
    };
    if (far(0, 2) <= far(1, 3)) {
      mesh_.triangles.push_back({q[0], q[1], q[2]});
      mesh_.triangles.push_back({q[0], q[2], q[3]});
    } else {
      mesh_.triangles.push_back({q[0], q[1], q[3]});
      mesh_.triangles.push_back({q[1], q[2], q[3]});
    }
  }

  const ImplicitSolid* solid_;  // while a brick is sampled, the solid simplified for it
  int cells_;                   // along the longest side
  double edge_m_ = 0.0;
  Eigen::Vector3d origin_m_;
  Cell size_{};
  int root_ = 0;
  TriangleMesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_of_;
  std::vector<BrickEdge> edges_ = std::vector<BrickEdge>(3 * kBrickCorners);
  std::array<BrickCorner, kBrickCorners> corners_{};
  std::array<bool, kBrickCorners> marked_{};  // the cells from these corners
  std::uint32_t brick_ = 0;                   // the number of the brick that is sampled
  std::vector<CrossedEdge> crossed_edges_;
  std::size_t thin_places_ = 0, meetings_ = 0;
  core::WorkMeter meter_;
  bool ended_ = false;
};

}  // namespace

Polygonised polygonise(const ImplicitSolid& solid, const PolygoniseOptions& options) {
  if (auto mesh = solid.tessellation()) return {std::move(*mesh), 0, true};
  const Box box = solid.bounding_box();
  if (box.empty() || !(box.size_m().maxCoeff() > 0.0)) return {};
  for (int cells = options.cells;; cells *= 2) {
    Polygoniser polygoniser(solid, box, cells, options.budget);
    Polygonised made = polygoniser.run();
    if (options.budget != nullptr && options.budget->ended()) return {};
    if ((made.whole && polygoniser.sheets_are_apart()) || 2 * cells > options.max_cells) return made;
  }
}

}  // namespace phantom::geometry
