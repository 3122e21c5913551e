#include "common/percept/view_node.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace phantom::percept {
namespace {

struct Node {
  const char* name;
  std::array<int, 3> signs;
};
constexpr std::array<Node, kNodeCount + 1> kNodes{{{"auto", {0, 0, 0}},
                                                   {"1", {1, 1, 1}},
                                                   {"2", {-1, 1, 1}},
                                                   {"3", {-1, -1, 1}},
                                                   {"4", {1, -1, 1}},
                                                   {"5", {1, 1, -1}},
                                                   {"6", {-1, 1, -1}},
                                                   {"7", {-1, -1, -1}},
                                                   {"8", {1, -1, -1}},
                                                   {"N", {0, 1, 0}},
                                                   {"S", {0, -1, 0}},
                                                   {"E", {1, 0, 0}},
                                                   {"W", {-1, 0, 0}},
                                                   {"T", {0, 0, 1}},
                                                   {"B", {0, 0, -1}}}};

}  // namespace

Eigen::Vector3d node_direction(ViewNode node) noexcept {
  const auto& s = kNodes[static_cast<std::size_t>(node)].signs;
  const Eigen::Vector3d direction(s[0], s[1], s[2]);
  return node == ViewNode::kAutomatic ? direction : direction.normalized().eval();
}

const char* node_name(ViewNode node) noexcept { return kNodes[static_cast<std::size_t>(node)].name; }

std::optional<ViewNode> node_from_number(double number) noexcept {
  if (!(number >= 0 && number <= kNodeCount) || number != std::floor(number)) return std::nullopt;
  return static_cast<ViewNode>(static_cast<int>(number));
}

std::optional<ViewNode> node_from_name(std::string_view name) noexcept {
  for (std::size_t number = 0; number < kNodes.size(); ++number) {
    if (name == kNodes[number].name) return static_cast<ViewNode>(number);
  }
  return std::nullopt;
}

Eigen::Vector3d direction_at(double azimuth_rad, double elevation_rad) noexcept {
  const double level = std::cos(elevation_rad);
  return {level * std::cos(azimuth_rad), level * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

Eigen::Matrix3d view_axes(const Eigen::Vector3d& backward) noexcept {
  const Eigen::Vector3d up =
      std::abs(backward.z()) > 0.999 ? Eigen::Vector3d::UnitY().eval() : Eigen::Vector3d::UnitZ().eval();
  const Eigen::Vector3d right = up.cross(backward).normalized();
  Eigen::Matrix3d rows;
  rows.row(0) = right;
  rows.row(1) = backward.cross(right);
  rows.row(2) = backward;
  return rows;
}

}  // namespace phantom::percept
