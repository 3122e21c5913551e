#include "common/dds/source_guard.hpp"

namespace phantom::dds {

SourceGuard::Verdict SourceGuard::judge(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
  const bool bound = accepted_ns_ != 0 && received_ns - accepted_ns_ < hold_ns_;
  if (bound && stamp.session() != session_) {
    rival_ns_ = received_ns;
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

}  // namespace phantom::dds
