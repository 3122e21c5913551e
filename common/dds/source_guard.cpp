#include "common/dds/source_guard.hpp"

namespace phantom::dds {

SourceGuard::Verdict SourceGuard::judge(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
  const bool bound = accepted_ns_ != 0 && received_ns - accepted_ns_ < hold_ns_;
  if (bound && stamp.session() != session_) {
    rival_ns_.store(received_ns, std::memory_order_relaxed);
    return Verdict::kRival;
  }
  if (!order_.accept(stamp)) return Verdict::kOutOfOrder;
  session_ = stamp.session();
  accepted_ns_ = received_ns;
  return Verdict::kAccepted;
}

const char* reason(SourceGuard::Verdict verdict) noexcept {
  switch (verdict) {
    case SourceGuard::Verdict::kOutOfOrder:
      return "it is older than one that came before";
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
