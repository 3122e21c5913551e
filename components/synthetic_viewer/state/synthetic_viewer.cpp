#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::synthetic_viewer {
namespace {

// A view from below is geometrically as good but unfamiliar, so its mirror image above is preferred.
constexpr double kFamiliar = 0.06;
// Weight of laterality when nothing is visible at all, so that the nodes stay ordered.
constexpr double kBlind = 0.05;
constexpr double kNoWay = 1e-3;  // of two directions that are alike or opposite

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

void SyntheticViewer::take(const AlertUpdate& update) noexcept {
  if (!update.cleared) {
    alerts_[next_] = {update, true};
    next_ = (next_ + 1) % kRemembered;
    return;
  }
  for (Alert& alert : alerts_) {
    if (alert.update.alert == update.alert) alert.pending = false;
  }
  if (shown_ && shown_->alert == update.alert && !shown_->cleared) {
    shown_->cleared = true;
    over_s_ = 0.0;
  }
}

void SyntheticViewer::follow(std::span<const ThreatPlace> threats) noexcept {
  threat_.reset();
  if (!shown_ || shown_->cleared) return;
  const auto now = std::ranges::find_if(threats, [this](const ThreatPlace& threat) {
    return threat.link == shown_->link && threat.object == shown_->object;
  });
  if (now != threats.end()) threat_ = *now;
}

HitView SyntheticViewer::step(bool hold, ViewNode chosen, const VisibleShare& visible, double dt_s) {
  shown_s_ += dt_s;
  if (shown_ && shown_->cleared) over_s_ += dt_s;
  const bool may_change = !shown_ || (!hold && (shown_->cleared || shown_s_ >= config_.least_show_s));
  if (may_change) {
    const Alert* newest = nullptr;
    // By arrival, not by number, because a restarted phantom counts from 1 again.
    for (std::size_t back = 1; back <= kRemembered && newest == nullptr; ++back) {
      const Alert& alert = alerts_[(next_ + kRemembered - back) % kRemembered];
      if (alert.pending) newest = &alert;
    }
    if (newest != nullptr) {
      shown_ = newest->update;
      threat_.reset();
      shown_s_ = over_s_ = 0.0;
      chooser_.release();
      // Older alerts are dropped: the view follows the newest.
      for (Alert& alert : alerts_) alert.pending = false;
    }
  }
  if (shown_ && shown_->cleared && !hold && over_s_ >= config_.hold_after_clear_s) shown_.reset();
  if (!shown_) return {};
  if (threat_ && !hold && !shown_->cleared) {
    // The place leaps where another sensor of the link becomes the most urgent.
    const double share = config_.follow_s > 0.0 ? 1.0 - std::exp(-dt_s / config_.follow_s) : 1.0;
    shown_->look_at_m += share * (threat_->position_m - shown_->look_at_m);
    if (!threat_->pgv.isZero()) {
      const Eigen::Vector3d way = threat_->pgv.normalized();
      const Eigen::Vector3d before = shown_->pgv.isZero() ? way : shown_->pgv.normalized();
      // From the opposite it turns, too, about any axis.
      const Eigen::Vector3d across = before.cross(way);
      const Eigen::Vector3d axis = across.norm() > kNoWay ? across.normalized() : before.unitOrthogonal();
      const double angle_rad = std::atan2(across.norm(), before.dot(way));
      shown_->pgv = threat_->pgv.norm() * (Eigen::AngleAxisd(share * angle_rad, axis) * before);
    }
  }
  HitView view;
  view.alert = shown_->alert;
  view.threatening = !shown_->cleared;
  view.link = shown_->link;
  view.object = shown_->object;
  view.situation = {shown_->look_at_m, shown_->pgv, chosen};
  view.node = chooser_.step(view.situation, visible, dt_s);
  view.eye_m = chooser_.eye_m(view.situation);
  return view;
}

}  // namespace phantom::synthetic_viewer
