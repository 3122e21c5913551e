#include "common/dds/admission/delay_monitor.hpp"

#include <algorithm>

namespace phantom::dds {

DelayMonitor& DelayMonitor::operator=(const DelayMonitor& other) noexcept {
  session_ = other.session_;
  quickest_ns_ = other.quickest_ns_;
  updated_ns_ = other.updated_ns_;
  punctual_ns_ = other.punctual_ns_;
  early_ = other.early_;
  difference_ns_ = other.difference_ns_.load();
  return *this;
}

void DelayMonitor::restart(std::uint64_t session, core::Nanoseconds age_ns,
                           core::Nanoseconds received_ns) noexcept {
  session_ = session;
  quickest_ns_ = age_ns;
  updated_ns_ = punctual_ns_ = received_ns;
  early_ = 0;
}

bool DelayMonitor::is_late(const msg::Stamp& stamp, core::Nanoseconds received_ns,
                           core::Nanoseconds received_utc_ns) noexcept {
  if (stamp.monotonic_ns() <= 0) return false;
  const core::Nanoseconds age_ns = received_ns - stamp.monotonic_ns();
  if (punctual_ns_ == 0 || stamp.session() != session_) restart(stamp.session(), age_ns, received_ns);
  quickest_ns_ += static_cast<core::Nanoseconds>(kDrift * static_cast<double>(received_ns - updated_ns_));
  updated_ns_ = received_ns;
  if (age_ns < quickest_ns_ - kLate_ns) {
    if (++early_ < kRun) return true;
    restart(session_, age_ns, received_ns);
  }
  early_ = 0;
  quickest_ns_ = std::min(quickest_ns_, age_ns);
  if (age_ns - quickest_ns_ > kLate_ns && received_ns - punctual_ns_ < kForget_ns) return true;
  if (age_ns - quickest_ns_ > kLate_ns) restart(session_, age_ns, received_ns);
  punctual_ns_ = received_ns;
  if (age_ns - quickest_ns_ < kPrompt_ns)
    difference_ns_.store(received_utc_ns - stamp.utc_ns(), std::memory_order_relaxed);
  return false;
}

std::optional<double> DelayMonitor::clock_difference_s() const noexcept {
  const core::Nanoseconds difference_ns = difference_ns_.load(std::memory_order_relaxed);
  if (difference_ns == kUnknown) return std::nullopt;
  return core::seconds(difference_ns);
}

}  // namespace phantom::dds
