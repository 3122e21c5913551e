#include "common/geometry/triangle_pairs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace phantom::geometry::detail {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr double kRounding = 1e-14;  // of a determinant, relative to the products it is made of

/// −1, 0, 1: side of d on the plane abc.
int side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = a - d, v = b - d, w = c - d;
  const double value = u.dot(v.cross(w));
  const double scale = u.norm() * v.norm() * w.norm();
  return value > kRounding * scale ? 1 : value < -kRounding * scale ? -1 : 0;
}

bool pierces(const Vector3d& p, const Vector3d& q, const Corners& t) {
  if (side(t[0], t[1], t[2], p) * side(t[0], t[1], t[2], q) >= 0) return false;
  const int first = side(p, q, t[0], t[1]);
  return first != 0 && side(p, q, t[1], t[2]) == first && side(p, q, t[2], t[0]) == first;
}

struct Plain {
  double x, y;
};

int turn(const Plain& a, const Plain& b, const Plain& c) {
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double doubt = kRounding * (std::abs(left) + std::abs(right));
  return left - right > doubt ? 1 : left - right < -doubt ? -1 : 0;
}

bool inside(const Plain& p, const std::array<Plain, 3>& t) {
  const int first = turn(t[0], t[1], p);
  return first != 0 && turn(t[1], t[2], p) == first && turn(t[2], t[0], p) == first;
}

bool overlap_in_plane(const Corners& s, const Corners& t) {
  const Vector3d normal = (s[1] - s[0]).cross(s[2] - s[0]);
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  std::array<Plain, 3> a{}, b{};
  for (std::size_t i = 0; i < 3; ++i) {
    a[i] = {s[i][(drop + 1) % 3], s[i][(drop + 2) % 3]};
    b[i] = {t[i][(drop + 1) % 3], t[i][(drop + 2) % 3]};
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (inside(a[i], b) || inside(b[i], a)) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Plain &p = a[i], &q = a[(i + 1) % 3], &u = b[k], &v = b[(k + 1) % 3];
      if (turn(p, q, u) * turn(p, q, v) < 0 && turn(u, v, p) * turn(u, v, q) < 0) return true;
    }
  }
  return false;
}

/// Boxes around groups of triangles; the left child is the next node.
class Boxes {
 public:
  explicit Boxes(const TriangleMesh& mesh) : order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    corners_.reserve(mesh.triangles.size());
    boxes_.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
      Corners corners;
      BoundingBox box;
      for (std::size_t i = 0; i < 3; ++i) {
        corners[i] = mesh.vertices_m[t[i]].cast<double>();
        box.extend(mesh.vertices_m[t[i]]);
      }
      corners_.push_back(corners);
      boxes_.push_back(box);
    }
    if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
  }

  TrianglePairs count(std::size_t max_pairs) {
    pairs_ = {};
    left_ = max_pairs;
    if (!nodes_.empty()) meet(0, 0);
    return pairs_;
  }

 private:
  struct Node {
    BoundingBox box;
    std::uint32_t first, count, right;  // right 0: leaf
  };

  std::uint32_t build(std::uint32_t first, std::uint32_t count) {
    const auto name = static_cast<std::uint32_t>(nodes_.size());
    Node node{{}, first, count, 0};
    for (std::uint32_t i = first; i < first + count; ++i) {
      node.box.extend(boxes_[order_[i]].min_m);
      node.box.extend(boxes_[order_[i]].max_m);
    }
    nodes_.push_back(node);
    if (count > 4) {
      int axis = 0;
      (node.box.max_m - node.box.min_m).maxCoeff(&axis);
      const auto begin = order_.begin() + first;
      std::nth_element(begin, begin + count / 2, begin + count, [&](std::uint32_t a, std::uint32_t b) {
        return boxes_[a].min_m[axis] + boxes_[a].max_m[axis] < boxes_[b].min_m[axis] + boxes_[b].max_m[axis];
      });
      build(first, count / 2);
      nodes_[name].right = build(first + count / 2, count - count / 2);
    }
    return name;
  }

  /// All pairs between two groups, or within one.
  void meet(std::uint32_t a, std::uint32_t b) {
    if (!pairs_.complete || !nodes_[a].box.intersects(nodes_[b].box)) return;
    const Node &s = nodes_[a], &t = nodes_[b];
    if (s.right == 0 && t.right == 0) return test_all(s, t, a == b);
    if (a == b) {
      meet(a + 1, a + 1);
      meet(s.right, s.right);
      meet(a + 1, s.right);
    } else if (t.right == 0 || (s.right != 0 && s.count >= t.count)) {
      meet(a + 1, b);
      meet(s.right, b);
    } else {
      meet(a, b + 1);
      meet(a, t.right);
    }
  }

  void test_all(const Node& s, const Node& t, bool same) {
    for (std::uint32_t i = s.first; i < s.first + s.count; ++i) {
      for (std::uint32_t k = same ? i + 1 : t.first; k < t.first + t.count; ++k) {
        if (left_ == 0) {
          pairs_.complete = false;
          return;
        }
        --left_;
        const std::uint32_t p = order_[i], q = order_[k];
        if (boxes_[p].intersects(boxes_[q]) && triangles_cross(corners_[p], corners_[q]))
          ++pairs_.intersecting;
      }
    }
  }

  std::vector<std::uint32_t> order_;
  std::vector<Corners> corners_;
  std::vector<BoundingBox> boxes_;
  std::vector<Node> nodes_;
  TrianglePairs pairs_;
  std::size_t left_ = 0;
};

}  // namespace

bool triangles_cross(const Corners& s, const Corners& t) {
  int front = 0, back = 0;
  for (const Vector3d& p : t) {
    const int where = side(s[0], s[1], s[2], p);
    front += where > 0 ? 1 : 0;
    back += where < 0 ? 1 : 0;
  }
  if (front == 3 || back == 3) return false;
  if (front == 0 && back == 0) return overlap_in_plane(s, t);
  for (std::size_t i = 0; i < 3; ++i) {
    if (pierces(s[i], s[(i + 1) % 3], t) || pierces(t[i], t[(i + 1) % 3], s)) return true;
  }
  return false;
}

TrianglePairs crossing_pairs(const TriangleMesh& mesh, std::size_t max_pairs) {
  return Boxes(mesh).count(max_pairs);
}

}  // namespace phantom::geometry::detail
