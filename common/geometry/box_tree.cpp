#include "common/geometry/box_tree.hpp"

#include <numeric>

namespace phantom::geometry {

std::vector<BoundingBox> triangle_boxes(const TriangleMesh& mesh) {
  std::vector<BoundingBox> boxes(mesh.triangles.size());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (const std::uint32_t vertex : mesh.triangles[i]) boxes[i].extend(mesh.vertices_m[vertex]);
  return boxes;
}

BoxTree::BoxTree(std::span<const BoundingBox> boxes, std::uint32_t leaf_items) : items_(boxes.size()) {
  std::iota(items_.begin(), items_.end(), 0U);
  if (items_.empty()) return;
  nodes_.reserve(2 * items_.size() / leaf_items + 1);
  build(boxes, 0, static_cast<std::uint32_t>(items_.size()), leaf_items);
}

std::uint32_t BoxTree::build(std::span<const BoundingBox> boxes, std::uint32_t from, std::uint32_t to,
                             std::uint32_t leaf_items) {
  const auto twice_centre = [&](std::uint32_t item) -> Eigen::Vector3f {
    return boxes[item].min_m + boxes[item].max_m;
  };
  BoundingBox box, centres;
  for (std::uint32_t place = from; place < to; ++place) {
    box.extend(boxes[items_[place]].min_m);
    box.extend(boxes[items_[place]].max_m);
    centres.extend(twice_centre(items_[place]));
  }
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({box.min_m.array(), box.max_m.array(), from, to - from});
  if (to - from <= leaf_items) return number;
  int axis = 0;
  (centres.max_m - centres.min_m).maxCoeff(&axis);
  const std::uint32_t half = from + (to - from) / 2;
  std::nth_element(
      items_.begin() + from, items_.begin() + half, items_.begin() + to,
      [&](std::uint32_t a, std::uint32_t b) { return twice_centre(a)[axis] < twice_centre(b)[axis]; });
  build(boxes, from, half, leaf_items);
  nodes_[number].first = build(boxes, half, to, leaf_items);
  nodes_[number].count = 0;
  return number;
}

}  // namespace phantom::geometry
