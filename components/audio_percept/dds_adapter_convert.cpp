#include "components/audio_percept/dds_adapter_convert.hpp"

#include <cmath>

#include "common/core/joints.hpp"

namespace phantom::audio_percept {
namespace {

bool in_range(double value, double low, double high) {
  return std::isfinite(value) && value >= low && value <= high;
}

bool joint_count_is_possible(std::uint32_t count) { return count >= 1 && count <= core::kMaxJoints; }

}  // namespace

bool PerceptConverter::accept(const msg::Percept& message, core::Nanoseconds received_ns,
                              PerceptSample& out) {
  constexpr double kFastest_m_s = 100.0;
  if (!in_range(message.closeness(), 0.0, 1.0) || !in_range(message.speed_m_s(), 0.0, kFastest_m_s) ||
      !joint_count_is_possible(message.joint_count()) || !guard_.accept(message.stamp())) {
    return false;
  }
  out = {received_ns, message.valid(), message.closeness(), message.speed_m_s()};
  return true;
}

bool LinkConverter::accept(const msg::Stamp& stamp, msg::LinkState state, msg::StopCause cause, std::uint32_t joint_count,
                           core::Nanoseconds received_ns, LinkSample& out) {
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
  if (!guard_.accept(stamp)) return false;
  out = {received_ns, link};
  return true;
}

bool AlertConverter::accept(const msg::HitAlert& message, core::Nanoseconds received_ns, AlertSample& out) {
  constexpr std::size_t kMostActive = 1000;
  const std::uint64_t session = message.stamp().session();
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

}  // namespace phantom::audio_percept
