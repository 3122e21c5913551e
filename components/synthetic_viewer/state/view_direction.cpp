#include "components/synthetic_viewer/state/view_direction.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace phantom::synthetic_viewer {
namespace {

/// Clockwise as seen from above, beginning at the operator, in steps of 45°.
constexpr std::array kSides{"side_word.front",      "side_word.front_right", "side_word.right",
                            "side_word.back_right", "side_word.back",        "side_word.back_left",
                            "side_word.left",       "side_word.front_left"};
constexpr double kLevel = 0.3;  // a direction that rises by more than this is from above, or from below

}  // namespace

LocalizedText direction_words(ViewNode node, double main_azimuth_rad) {
  if (node == ViewNode::kAutomatic) return {"direction.automatic", {}};
  if (node == ViewNode::kTop) return {"direction.top", {}};
  if (node == ViewNode::kBottom) return {"direction.bottom", {}};
  const Eigen::Vector3d towards = percept::node_direction(node);
  const Eigen::Vector2d front(std::cos(main_azimuth_rad), std::sin(main_azimuth_rad)),
      right(-front.y(), front.x());
  const double angle_rad = std::atan2(towards.head<2>().dot(right), towards.head<2>().dot(front));
  const auto steps =
      static_cast<std::size_t>(std::lround(angle_rad / (std::numbers::pi / 4)) + 8) % kSides.size();
  const char* key = towards.z() > kLevel    ? "direction.upper"
                    : towards.z() < -kLevel ? "direction.lower"
                                            : "direction.level";
  return {key, {{"side", LocalizedText{kSides[steps], {}}}}};
}

}  // namespace phantom::synthetic_viewer
