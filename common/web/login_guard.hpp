#pragma once

#include <mutex>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/recent_map.hpp"

namespace phantom::web {

/// How many wrong secrets may be tried.
struct LoginLimits {
  int tries = 5;          ///< that one address has at once …
  int each_s = 10;        ///< … and the time after which it gets one of them back
  int tries_in_all = 60;  ///< the same of all addresses together
  int each_in_all_s = 1;
  std::size_t addresses = 256;  ///< remembered at most; who has tried longest ago is forgotten first
  std::size_t known = 64;       ///< addresses remembered at most that have sent a right secret
};

/// Slows down who guesses the page's secrets. Each try is taken before the secret is looked at and given back
/// if it was right, so that tries at the same time do not slip through; a right one restores nothing else, so
/// that who knows one secret gains nothing for guessing another. An address that has used up its own tries
/// uses none of those in all, and one that has sent a right secret has its own tries whatever the others do,
/// so that guessing from many addresses keeps out nobody who was in before. Time comes in. Thread-safe.
class LoginGuard {
 public:
  explicit LoginGuard(const LoginLimits& limits = {})
      : limits_(limits), addresses_(limits.addresses), known_(limits.known) {}

  /// Takes a try of `network` (network_of()). Returns 0, or for how many seconds there is none.
  int take(const std::string& network, core::Nanoseconds now_ns);
  /// Gives the try back that was taken last.
  void give_back(const std::string& network);

 private:
  /// When all tries are back, if each comes back after the one before it.
  struct Used {
    core::Nanoseconds until_ns = 0;
    core::Nanoseconds wait_ns(int tries, int each_s, core::Nanoseconds now_ns) const;
    void take(int each_s, core::Nanoseconds now_ns);
    void give_back(int each_s);
  };

  const LoginLimits limits_;
  std::mutex mutex_;
  Used in_all_;
  core::RecentMap<std::string, Used> addresses_;
  core::RecentMap<std::string, Used> known_;  // have sent a right secret
};

}  // namespace phantom::web
