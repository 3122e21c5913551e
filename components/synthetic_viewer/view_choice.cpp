#include "components/synthetic_viewer/view_choice.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::synthetic_viewer {
namespace {

// A view from below is geometrically as good but unfamiliar, so its mirror image above is preferred.
constexpr double kFamiliar = 0.06;
// Weight of laterality when nothing is visible at all, so that the nodes stay ordered.
constexpr double kBlind = 0.05;

}  // namespace

using percept::kNodeCount;
using percept::node_direction;

ViewChooser::Scores ViewChooser::scores(const ViewSituation& situation, const VisibleShare& visible) const {
  Scores result{};
  const double length = situation.pgv.norm();
  for (int number = 1; number <= kNodeCount; ++number) {
    const Eigen::Vector3d direction = node_direction(static_cast<ViewNode>(number));
    const double along = length > 0 ? direction.dot(situation.pgv) / length : 0.0;
    const double lateral = std::sqrt(std::max(0.0, 1 - along * along));
    const double seen =
        std::clamp(visible(situation, situation.look_at_m + config_.distance_m * direction), 0.0, 1.0);
    result[static_cast<std::size_t>(number)] =
        seen * (0.25 + 0.75 * lateral) + kBlind * lateral + kFamiliar * (direction.z() >= 0 ? 1 : 0);
  }
  return result;
}

void ViewChooser::change_to(ViewNode node) noexcept {
  if (node != node_) stayed_s_ = 0;
  node_ = node;
  better_s_ = 0;
  free_ = false;
}

ViewNode ViewChooser::step(const ViewSituation& situation, const VisibleShare& visible, double dt_s) {
  stayed_s_ += dt_s;
  if (situation.chosen != ViewNode::kAutomatic) {
    change_to(situation.chosen);
    return node_;
  }
  const Scores score = scores(situation, visible);
  const auto best = static_cast<ViewNode>(std::max_element(score.begin() + 1, score.end()) - score.begin());
  const double mine = node_ == ViewNode::kAutomatic ? -1.0 : score[static_cast<std::size_t>(node_)];
  const bool better = score[static_cast<std::size_t>(best)] > mine + config_.margin;
  if (free_) {
    change_to(better ? best : node_);
    return node_;
  }
  better_s_ = better ? better_s_ + dt_s : 0.0;
  if (better_s_ >= config_.dwell_s && stayed_s_ >= config_.least_stay_s) change_to(best);
  return node_;
}

}  // namespace phantom::synthetic_viewer
