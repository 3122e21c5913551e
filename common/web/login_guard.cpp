#include "common/web/login_guard.hpp"

#include <algorithm>

namespace phantom::web {

core::Nanoseconds LoginGuard::Used::wait_ns(int tries, int each_s, core::Nanoseconds now_ns) const {
  return until_ns - now_ns - (tries - 1LL) * each_s * core::kNsPerSecond;
}

void LoginGuard::Used::take(int each_s, core::Nanoseconds now_ns) {
  until_ns = std::max(until_ns, now_ns) + each_s * core::kNsPerSecond;
}

void LoginGuard::Used::give_back(int each_s) { until_ns -= each_s * core::kNsPerSecond; }

int LoginGuard::take(const std::string& network, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  const bool known = known_.contains(network);
  Used& own = (known ? known_ : addresses_).find_or_add(network).first;
  core::Nanoseconds wait_ns = own.wait_ns(limits_.tries, limits_.each_s, now_ns);
  if (!known)
    wait_ns = std::max(wait_ns, in_all_.wait_ns(limits_.tries_in_all, limits_.each_in_all_s, now_ns));
  if (wait_ns > 0) return static_cast<int>((wait_ns + core::kNsPerSecond - 1) / core::kNsPerSecond);
  own.take(limits_.each_s, now_ns);
  if (!known) in_all_.take(limits_.each_in_all_s, now_ns);
  return 0;
}

void LoginGuard::give_back(const std::string& network) {
  const std::lock_guard lock(mutex_);
  if (known_.contains(network)) return known_.find_or_add(network).first.give_back(limits_.each_s);
  Used& own = addresses_.find_or_add(network).first;
  own.give_back(limits_.each_s);
  in_all_.give_back(limits_.each_in_all_s);
  known_.find_or_add(network).first = own;
}

}  // namespace phantom::web
