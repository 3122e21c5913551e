#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Returns the box of each triangle.
std::vector<BoundingBox> triangle_boxes(const TriangleMesh& mesh);

/// A bounding-volume hierarchy: a binary tree of axis-aligned boxes around numbered items, halved along the
/// axis in which the centres of their boxes extend farthest. Queries report items by place: their position in
/// the order of the leaves. Users decide what the items are, and should store their data in that order.
/// Queries are thread-safe and allocate nothing; points and rays are in the boxes' frame, in any unit.
class BoxTree {
 public:
  struct Node {
    Eigen::Array3f min, max;
    /// Leaf: place of its first item. Inner node: number of the second child; the first child is the next
    /// node.
    std::uint32_t first = 0;
    std::uint32_t count = 0;  ///< items of a leaf; 0: inner node
  };

  BoxTree() = default;
  /// Builds the tree in O(n log n). `boxes`: one per item, finite and not empty. Leaves hold at most
  /// `leaf_items`.
  explicit BoxTree(std::span<const BoundingBox> boxes, std::uint32_t leaf_items = 4);

  /// Returns the items' numbers by place.
  const std::vector<std::uint32_t>& items() const { return items_; }
  /// Returns the nodes, root first and every node before its descendants; empty if there are no items.
  const std::vector<Node>& nodes() const { return nodes_; }

  /// Runs a general query: calls enter(number of a node) from the root down. Where it returns true, the
  /// node's children are entered, or visit(place) is called for each item of the leaf.
  template <class Enter, class Visit>
  void walk(Enter&& enter, Visit&& visit) const;

  /// Calls visit(place) for all items whose boxes are at most √`square` away from `p`, the most promising
  /// first. visit lowers `square` to that of the nearest item so far.
  template <class Visit>
  void near(const Eigen::Vector3d& p, double& square, Visit&& visit) const;

  /// Calls visit(place) for all items whose boxes are met by origin + s · direction for an s in [from, to].
  /// visit may lower `to`.
  template <class Visit>
  void along_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double from, double& to,
                 Visit&& visit) const;

  /// Calls visit(place, other place) for every pair of items in leaves whose boxes meet, until visit returns
  /// false. Returns whether visit never did.
  template <class Visit>
  bool pairs(Visit&& visit) const {
    return nodes_.empty() || pairs_between(0, 0, visit);
  }

 private:
  static constexpr std::size_t kMaxWaiting = 64;  // halving 2³² items takes 32 levels

  std::uint32_t build(std::span<const BoundingBox> boxes, std::uint32_t from, std::uint32_t to,
                      std::uint32_t leaf_items);
  static double square_to(const Node& node, const Eigen::Vector3d& p) {
    return (node.min.cast<double>() - p.array())
        .max(p.array() - node.max.cast<double>())
        .max(0.0)
        .matrix()
        .squaredNorm();
  }
  static bool meets(const Node& node, const Eigen::Array3d& origin, const Eigen::Array3d& inverse,
                    double from, double to);
  static bool meet(const Node& a, const Node& b) { return (a.min <= b.max).all() && (b.min <= a.max).all(); }
  template <class Visit>
  bool pairs_between(std::uint32_t a, std::uint32_t b, Visit& visit) const;

  std::vector<std::uint32_t> items_;
  std::vector<Node> nodes_;
};

inline bool BoxTree::meets(const Node& node, const Eigen::Array3d& origin, const Eigen::Array3d& inverse,
                           double from, double to) {
  for (int axis = 0; axis < 3; ++axis) {
    const double near = (static_cast<double>(node.min[axis]) - origin[axis]) * inverse[axis];
    const double far = (static_cast<double>(node.max[axis]) - origin[axis]) * inverse[axis];
    if (std::isnan(near) || std::isnan(far)) continue;  // 0·∞: the ray runs in a face of the box
    from = std::max(from, std::min(near, far));
    to = std::min(to, std::max(near, far));
  }
  return from <= to;
}

template <class Enter, class Visit>
void BoxTree::walk(Enter&& enter, Visit&& visit) const {
  if (nodes_.empty()) return;
  std::array<std::uint32_t, kMaxWaiting> waiting;
  std::size_t depth = 0;
  waiting[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t number = waiting[--depth];
    if (!enter(number)) continue;
    const Node& node = nodes_[number];
    if (node.count == 0) {
      waiting[depth++] = node.first;
      waiting[depth++] = number + 1;
    }
    for (std::uint32_t place = node.first; place < node.first + node.count; ++place) visit(place);
  }
}

template <class Visit>
void BoxTree::near(const Eigen::Vector3d& p, double& square, Visit&& visit) const {
  if (nodes_.empty()) return;
  constexpr double kRounding = 1.0 + 1e-12;  // never cut off items at the same distance
  struct Waiting {
    std::uint32_t node;
    double square;
  };
  std::array<Waiting, kMaxWaiting> waiting;
  std::size_t depth = 0;
  waiting[depth++] = {0, square_to(nodes_[0], p)};
  while (depth > 0) {
    const Waiting next = waiting[--depth];
    if (next.square > square * kRounding) continue;
    const Node& node = nodes_[next.node];
    for (std::uint32_t place = node.first; place < node.first + node.count; ++place) visit(place);
    if (node.count > 0) continue;
    const Waiting left{next.node + 1, square_to(nodes_[next.node + 1], p)};
    const Waiting right{node.first, square_to(nodes_[node.first], p)};
    waiting[depth++] = left.square < right.square ? right : left;  // the nearer child is visited first
    waiting[depth++] = left.square < right.square ? left : right;
  }
}

template <class Visit>
void BoxTree::along_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double from,
                        double& to, Visit&& visit) const {
  const Eigen::Array3d inverse = direction.array().inverse();
  walk([&](std::uint32_t node) { return meets(nodes_[node], origin.array(), inverse, from, to); }, visit);
}

template <class Visit>
bool BoxTree::pairs_between(std::uint32_t a, std::uint32_t b, Visit& visit) const {
  const Node &s = nodes_[a], &t = nodes_[b];
  if (!meet(s, t)) return true;
  if (s.count > 0 && t.count > 0) {
    for (std::uint32_t i = s.first; i < s.first + s.count; ++i) {
      for (std::uint32_t k = a == b ? i + 1 : t.first; k < t.first + t.count; ++k) {
        if (!visit(i, k)) return false;
      }
    }
    return true;
  }
  if (a == b)
    return pairs_between(a + 1, a + 1, visit) && pairs_between(s.first, s.first, visit) &&
           pairs_between(a + 1, s.first, visit);
  const bool halve_a = t.count > 0 || (s.count == 0 && (s.max - s.min).sum() >= (t.max - t.min).sum());
  return halve_a ? pairs_between(a + 1, b, visit) && pairs_between(s.first, b, visit)
                 : pairs_between(a, b + 1, visit) && pairs_between(a, t.first, visit);
}

}  // namespace phantom::geometry
