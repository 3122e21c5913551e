#include "common/dds/admission/source_guard.hpp"

#include <algorithm>
#include <utility>

namespace phantom::dds {

SourceGuard& SourceGuard::operator=(const SourceGuard& other) noexcept {
  hold_ns_ = other.hold_ns_;
  accepted_ns_ = other.accepted_ns_;
  order_ = other.order_;
  rival_since_accepted_ = other.rival_since_accepted_;
  session_ = other.session_.load();
  rival_session_ = other.rival_session_.load();
  rival_samples_ = other.rival_samples_.load();
  heard_ns_ = other.heard_ns_.load();
  rival_ns_ = other.rival_ns_.load();
  second_ns_ = other.second_ns_.load();
  return *this;
}

SourceGuard::Verdict SourceGuard::assess(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
  if (is_rival(stamp, received_ns)) return refuse_rival(stamp, received_ns);
  if (received_ns - accepted_ns_ >= hold_ns_) order_ = SequenceGuard();
  if (!order_.accept(stamp)) return Verdict::kOutOfOrder;
  accepted_ns_ = received_ns;
  if (std::exchange(rival_since_accepted_, false) && stamp.session() == session())
    second_ns_.store(received_ns, std::memory_order_relaxed);
  session_.store(stamp.session(), std::memory_order_relaxed);
  heard_ns_.store(received_ns, std::memory_order_release);
  return Verdict::kAccepted;
}

SourceGuard::Verdict SourceGuard::assess_event(const msg::Stamp& stamp, core::Nanoseconds received_ns,
                                               const SourceGuard& periodic) noexcept {
  if (periodic.is_rival(stamp, received_ns)) return refuse_rival(stamp, received_ns);
  const bool newer = order_.accept(stamp);
  if (newer) session_.store(stamp.session(), std::memory_order_relaxed);
  return newer ? Verdict::kAccepted : Verdict::kOutOfOrder;
}

SourceGuard::Verdict SourceGuard::refuse_rival(const msg::Stamp& stamp,
                                               core::Nanoseconds received_ns) noexcept {
  rival_since_accepted_ = true;
  rival_session_.store(stamp.session(), std::memory_order_relaxed);
  rival_ns_.store(received_ns, std::memory_order_relaxed);
  rival_samples_.fetch_add(1, std::memory_order_relaxed);
  return Verdict::kRival;
}

bool SourceGuard::is_rival(const msg::Stamp& stamp, core::Nanoseconds now_ns) const noexcept {
  const core::Nanoseconds heard_ns = heard_ns_.load(std::memory_order_acquire);
  return heard_ns != 0 && now_ns - heard_ns < hold_ns_ && stamp.session() != session();
}

void SourceGuard::heard(std::uint64_t session, core::Nanoseconds now_ns) noexcept {
  const bool bound = heard_ns_.load(std::memory_order_relaxed) != 0;
  if (bound && session == this->session()) heard_ns_.store(now_ns, std::memory_order_relaxed);
}

bool SourceGuard::has_rival(core::Nanoseconds now_ns) const noexcept {
  const core::Nanoseconds rival_ns = rival_ns_.load(std::memory_order_relaxed);
  return rival_ns != 0 && now_ns - rival_ns < std::max(kRivalMemory_ns, hold_ns_);
}

bool SourceGuard::has_second(core::Nanoseconds now_ns) const noexcept {
  const core::Nanoseconds second_ns = second_ns_.load(std::memory_order_relaxed);
  return second_ns != 0 && now_ns - second_ns < kRivalMemory_ns;
}

const char* reason(SourceGuard::Verdict verdict) noexcept {
  switch (verdict) {
    case SourceGuard::Verdict::kOutOfOrder:
      return "its number does not follow that of the one before: it is older, or numbered wrongly";
    case SourceGuard::Verdict::kRival:
      return "another process writes this topic too, and was here first";
    case SourceGuard::Verdict::kAccepted:
      break;
  }
  return nullptr;
}

core::Health with_rival(core::Health health, const char* topic) {
  const bool worse =
      health.state == core::ComponentState::kFault || health.state == core::ComponentState::kStopped;
  if (!worse) health.state = core::ComponentState::kDegraded;
  health.message = std::string("two processes send ") + topic +
                   ": only the first is heeded; end one of them" +
                   (health.message.empty() ? "" : "; " + health.message);
  return health;
}

}  // namespace phantom::dds
