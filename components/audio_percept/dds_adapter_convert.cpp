#include "components/audio_percept/dds_adapter_convert.hpp"

#include "common/core/elapsed.hpp"

namespace phantom::audio_percept {
namespace {

// Returns the stamp's time if the sender shares this host's clock, else `received_ns`. The clocks of two
// hosts differ by more than a second, because the hosts were not started within the same second.
core::Nanoseconds sent_ns(const msg::Stamp& stamp, core::Nanoseconds received_ns) {
  const core::Nanoseconds age_ns = core::elapsed_ns(stamp.monotonic_ns(), received_ns);
  return age_ns >= 0 && age_ns <= core::from_seconds(1.0) ? stamp.monotonic_ns() : received_ns;
}

}  // namespace

bool PerceptConverter::accept(const msg::Percept& message, core::Nanoseconds received_ns,
                              PerceptSample& out) {
  const auto percept = messages::from_idl(message);
  if (!percept || !source_.accept(message.stamp(), received_ns)) return false;
  followed_.heard(message.stamp(), received_ns);
  out = {received_ns,
         percept->valid,
         percept->closeness,
         percept->speed_m_s,
         percept->position_m,
         percept->condition,
         percept->muted_sensors > 0,
         sent_ns(message.stamp(), received_ns)};
  return true;
}

bool AlertConverter::accept(const msg::HitAlert& message, core::Nanoseconds received_ns, AlertSample& out) {
  constexpr std::size_t kMaxActive = 1000;
  const auto alert = messages::from_idl(message);
  const std::uint64_t session = message.stamp().session();
  if (phantom_ != nullptr && phantom_->is_rival(message.stamp(), received_ns)) return false;
  if (!alert || !guard_.accept(message.stamp())) return false;
  if (session != session_) active_.clear();
  session_ = session;
  if (alert->cleared) {
    active_.erase(alert->alert);
  } else {
    // Keeps the set bounded, whatever arrives.
    if (active_.size() >= kMaxActive) active_.erase(active_.begin());
    active_.insert(alert->alert);
    raised_ns_ = received_ns;
  }
  out = {raised_ns_, static_cast<std::uint32_t>(active_.size())};
  return true;
}

bool ViewConverter::accept(const msg::ViewPose& message, core::Nanoseconds received_ns, ViewSample& out) {
  const auto view = messages::from_idl(message);
  if (!view || !source_.accept(message.stamp(), received_ns)) return false;
  const Eigen::Matrix3d& R_WC = view->X_WC.rotation;  // columns: right, up and backward, in W
  out.received_ns = received_ns;
  for (std::size_t i = 0; i < out.axes.size(); ++i)
    Eigen::Vector3d::Map(out.axes[i].data()) = R_WC.col(static_cast<Eigen::Index>(i));
  return true;
}

bool CommandConverter::accept(const msg::OperatorCommand& message, core::Nanoseconds received_ns,
                              CommandSample& out) {
  const auto command = messages::from_idl(message);
  if (!command) return false;
  if (command->kind == teleop::CommandKind::kReset) latest_.reset_ns = received_ns;
  if (command->kind == teleop::CommandKind::kViewNode) {
    const auto view = percept::node_from_number(command->value);
    // 0 leaves the choice to the viewer, which turns its hit view by itself: the listener then faces as
    // configured.
    latest_.view = view == percept::ViewNode::kAutomatic ? std::nullopt : view;
  }
  out = latest_;
  return true;
}

}  // namespace phantom::audio_percept
