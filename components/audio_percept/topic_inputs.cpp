#include "components/audio_percept/topic_inputs.hpp"

namespace phantom::audio_percept {

AlertSample AlertCount::take(const messages::Received<messages::HitAlert>& alert) {
  constexpr std::size_t kMaxActive = 1000;
  if (alert.stamp.session != session_) active_.clear();
  session_ = alert.stamp.session;
  if (alert.cleared) {
    active_.erase(alert.alert);
  } else {
    // Keeps the set bounded, whatever arrives.
    if (active_.size() >= kMaxActive) active_.erase(active_.begin());
    active_.insert(alert.alert);
    raised_ns_ = alert.received_ns;
  }
  return {raised_ns_, static_cast<std::uint32_t>(active_.size())};
}

void take(const messages::OperatorCommand& command, core::Nanoseconds received_ns, CommandSample& sample) {
  if (command.kind == teleop::CommandKind::kReset) sample.reset_ns = received_ns;
  if (command.kind != teleop::CommandKind::kViewNode) return;
  // 0 leaves the choice to the viewer, which turns its hit view by itself: the listener then faces as
  // configured.
  const auto view = percept::node_from_number(command.value);
  sample.view = view == percept::ViewNode::kAutomatic ? std::nullopt : view;
}

ViewSample view_of(const messages::Received<messages::ViewPose>& view) {
  const Eigen::Matrix3d& R_WC = view.X_WC.rotation;  // columns: right, up and backward, in W
  ViewSample sample{view.received_ns, {}};
  for (std::size_t i = 0; i < sample.axes.size(); ++i)
    Eigen::Vector3d::Map(sample.axes[i].data()) = R_WC.col(static_cast<Eigen::Index>(i));
  return sample;
}

}  // namespace phantom::audio_percept
