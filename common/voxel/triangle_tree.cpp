#include "common/voxel/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/geometry/point_triangle.hpp"

namespace phantom::voxel::detail {
namespace {

constexpr std::size_t kLeaf = 4;
constexpr int kDeepest = 64;  // halving 2³² triangles takes 32 levels

}  // namespace

TriangleTree::TriangleTree(const geometry::TriangleMesh& mesh_W, const GridSpec& grid) {
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh_W.vertices_m.size());
  for (const Eigen::Vector3f& vertex : mesh_W.vertices_m)
    vertices.push_back((vertex.cast<double>() - grid.origin_m) / grid.voxel_size_m);
  for (const auto& t : mesh_W.triangles) corners_.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  if (corners_.empty()) return;
  std::vector<std::uint32_t> order(corners_.size());
  std::iota(order.begin(), order.end(), 0U);
  nodes_.reserve(corners_.size());
  build(order, 0, order.size());
  std::vector<std::array<Eigen::Vector3d, 3>> sorted;
  sorted.reserve(corners_.size());
  for (const std::uint32_t i : order) sorted.push_back(corners_[i]);
  corners_ = std::move(sorted);
}

std::uint32_t TriangleTree::build(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(kFar), high = -low, first_middle = low, last_middle = high;
  const auto middle = [this](std::uint32_t i) {
    return Eigen::Vector3d(corners_[i][0] + corners_[i][1] + corners_[i][2]);
  };
  for (std::size_t i = from; i < to; ++i) {
    for (const auto& corner : corners_[order[i]]) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    first_middle = first_middle.cwiseMin(middle(order[i]));
    last_middle = last_middle.cwiseMax(middle(order[i]));
  }
  nodes_[index].low = low;
  nodes_[index].high = high;
  if (to - from <= kLeaf) {
    nodes_[index].first = static_cast<std::uint32_t>(from);
    nodes_[index].count = static_cast<std::uint32_t>(to - from);
    return index;
  }
  int axis = 0;
  (last_middle - first_middle).maxCoeff(&axis);
  const std::size_t half = from + (to - from) / 2;
  using Difference = std::vector<std::uint32_t>::difference_type;
  std::nth_element(order.begin() + static_cast<Difference>(from),
                   order.begin() + static_cast<Difference>(half), order.begin() + static_cast<Difference>(to),
                   [&](std::uint32_t a, std::uint32_t b) { return middle(a)[axis] < middle(b)[axis]; });
  build(order, from, half);
  const std::uint32_t right = build(order, half, to);
  nodes_[index].right = right;
  return index;
}

NearestPoint TriangleTree::on_triangle(const Eigen::Vector3d& p_vox, std::uint32_t triangle) const {
  const auto& t = corners_[triangle];
  const Eigen::Vector3d point = geometry::closest_point_on_triangle(p_vox, t[0], t[1], t[2]);
  return {(point - p_vox).squaredNorm(), point, triangle};
}

NearestPoint TriangleTree::nearest_with_guess(const Eigen::Vector3d& p_vox, std::uint32_t guess) const {
  const NearestPoint there = on_triangle(p_vox, guess);
  return search(p_vox, std::sqrt(there.distance_vox), there);
}

NearestPoint TriangleTree::search(const Eigen::Vector3d& p_vox, double limit_vox, NearestPoint best) const {
  if (nodes_.empty()) return best;
  constexpr double kRounding = 1.0 + 1e-12;  // never cut off what is as near
  double least = limit_vox * limit_vox * kRounding;
  struct Waiting {
    std::uint32_t node;
    double square;
  };
  std::array<Waiting, kDeepest> waiting;
  std::size_t count = 0;
  waiting[count++] = {0, square_to(nodes_[0], p_vox)};
  while (count > 0) {
    const Waiting next = waiting[--count];
    if (next.square > least * kRounding) continue;
    const Node& node = nodes_[next.node];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const NearestPoint there = on_triangle(p_vox, i);
        if (there.distance_vox > least) continue;
        least = there.distance_vox;
        best = there;
      }
      continue;
    }
    const Waiting left{next.node + 1, square_to(nodes_[next.node + 1], p_vox)};
    const Waiting right{node.right, square_to(nodes_[node.right], p_vox)};
    waiting[count++] = left.square < right.square ? right : left;  // the nearer one is looked at first
    waiting[count++] = left.square < right.square ? left : right;
  }
  best.distance_vox = std::sqrt(best.distance_vox);
  return best;
}

}  // namespace phantom::voxel::detail
