#include "components/audio_percept/dds_adapter_convert.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "common/core/elapsed.hpp"
#include "common/core/joints.hpp"

namespace phantom::audio_percept {
namespace {

bool in_range(double value, double low, double high) {
  return std::isfinite(value) && value >= low && value <= high;
}

bool is_finite(const msg::Vector3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

std::optional<Model> model_of(msg::PerceptCondition condition) {
  switch (condition) {
    case msg::PERCEPT_FRESH:
      return Model::kSound;
    case msg::PERCEPT_WORKSPACE_UNATTENDED:
    case msg::PERCEPT_WORKSPACE_BEHIND:
      return Model::kAged;
    case msg::PERCEPT_WORKSPACE_STALE:
    case msg::PERCEPT_NO_WORKSPACE:
      return Model::kStale;
    case msg::PERCEPT_NO_STATE:
    case msg::PERCEPT_STATE_STALE:
      return Model::kNoState;
    case msg::PERCEPT_SELF_TEST_FAILED:
      return Model::kTestFailed;
  }
  return std::nullopt;
}

// The stamp's time where the sender's clock is this host's: those of two hosts lie further apart, as the
// hosts were not started within the same second.
core::Nanoseconds sent_ns(const msg::Stamp& stamp, core::Nanoseconds received_ns) {
  const core::Nanoseconds age_ns = core::elapsed_ns(stamp.monotonic_ns(), received_ns);
  return age_ns >= 0 && age_ns <= core::from_seconds(1.0) ? stamp.monotonic_ns() : received_ns;
}

bool joint_count_is_possible(std::uint32_t count) { return count >= 1 && count <= core::kMaxJoints; }

}  // namespace

bool PerceptConverter::accept(const msg::Percept& message, core::Nanoseconds received_ns,
                              PerceptSample& out) {
  constexpr double kFastest_m_s = 100.0;
  const auto model = model_of(message.condition());
  if (!in_range(message.closeness(), 0.0, 1.0) || !in_range(message.speed_m_s(), 0.0, kFastest_m_s) ||
      !is_finite(message.position_m()) || !model || !joint_count_is_possible(message.joint_count()) ||
      !source_.accept(message.stamp(), received_ns)) {
    return false;
  }
  followed_.heard(message.stamp(), received_ns);
  out = {received_ns,
         message.valid(),
         message.closeness(),
         message.speed_m_s(),
         {message.position_m().x(), message.position_m().y(), message.position_m().z()},
         *model,
         message.muted_sensors() > 0,
         sent_ns(message.stamp(), received_ns)};
  return true;
}

bool LinkConverter::accept(const msg::Stamp& stamp, msg::LinkState state, msg::StopCause cause,
                           std::uint32_t joint_count, core::Nanoseconds received_ns, LinkSample& out) {
  if (!joint_count_is_possible(joint_count)) return false;
  Link link = Link::kIdle;
  switch (state) {
    case msg::LINK_INIT:
      break;
    case msg::LINK_READY:
    case msg::LINK_ALIGNED:
    case msg::LINK_COUPLED:
      link = Link::kActive;
      break;
    case msg::LINK_DEGRADED:
      link = Link::kDegraded;
      break;
    case msg::LINK_STOPPED:
      link = cause == msg::STOP_DRIVE_FAULT ? Link::kDriveFault : Link::kStopped;
      break;
    default:
      return false;
  }
  if (!source_.accept(stamp, received_ns)) return false;
  out = {received_ns, link};
  return true;
}

bool AlertConverter::accept(const msg::HitAlert& message, core::Nanoseconds received_ns, AlertSample& out) {
  constexpr std::size_t kMostActive = 1000;
  const std::uint64_t session = message.stamp().session();
  if (phantom_ != nullptr && phantom_->is_rival(message.stamp(), received_ns)) return false;
  if (message.alert() == 0 || !guard_.accept(message.stamp())) return false;
  if (session != session_) active_.clear();
  session_ = session;
  if (message.cleared()) {
    active_.erase(message.alert());
  } else {
    if (active_.size() >= kMostActive) active_.erase(active_.begin());  // bounded, whatever arrives
    active_.insert(message.alert());
    raised_ns_ = received_ns;
  }
  out = {raised_ns_, static_cast<std::uint32_t>(active_.size())};
  return true;
}

bool ViewConverter::accept(const msg::ViewPose& message, core::Nanoseconds received_ns, ViewSample& out) {
  const msg::Pose& pose = message.X_WC();
  const Eigen::Quaterniond q(pose.qw(), pose.qx(), pose.qy(), pose.qz());
  constexpr double kNormTolerance = 1e-3;
  if (!(std::abs(q.norm() - 1) <= kNormTolerance) || message.node() > percept::kNodeCount ||
      message.view() > msg::VIEW_HIT || !is_finite(pose.position_m()) || !is_finite(message.look_at_m()) ||
      !source_.accept(message.stamp(), received_ns)) {
    return false;
  }
  const Eigen::Matrix3d R_WC = q.normalized().toRotationMatrix();  // columns: right, up, backward in W
  out.received_ns = received_ns;
  for (std::size_t i = 0; i < out.axes.size(); ++i)
    Eigen::Vector3d::Map(out.axes[i].data()) = R_WC.col(static_cast<Eigen::Index>(i));
  return true;
}

bool CommandConverter::accept(const msg::OperatorCommand& message, core::Nanoseconds received_ns,
                              CommandSample& out) {
  if (message.kind() == msg::COMMAND_RESET) latest_.reset_ns = received_ns;
  if (message.kind() == msg::COMMAND_VIEW_NODE) {
    const auto view = percept::node_from_number(message.value());
    if (!view) return false;
    // 0 gives the choice back to the viewer, which turns its hit view by itself: the ears face as configured.
    latest_.view = view == percept::ViewNode::kAutomatic ? std::nullopt : view;
  }
  out = latest_;
  return true;
}

}  // namespace phantom::audio_percept
