#include "common/messages/clock_report.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cmath>

namespace phantom::messages {
namespace {

// Whole days say more than millions of seconds.
std::string duration_words(double seconds) {
  constexpr double kDay_s = 86'400.0;
  return seconds < 2.0 * kDay_s ? fmt::format("{:.1f} s", seconds)
                                : fmt::format("{:.0f} days", seconds / kDay_s);
}

}  // namespace

void ClockReport::add_to(core::Health& health, std::optional<double> difference_s, core::Nanoseconds now_ns) {
  if (!difference_s || std::abs(*difference_s) < kFigure_s) return;
  health.figures.push_back({"clock_ahead_of_" + partner_, *difference_s, "s"});
  if (std::abs(*difference_s) < kReported_s) return;
  const std::string sentence = fmt::format("clocks differ by {}: this host's is {} that of {}'s host",
                                           duration_words(std::abs(*difference_s)),
                                           *difference_s > 0.0 ? "ahead of" : "behind", partner_);
  health.message += (health.message.empty() ? "" : "; ") + sentence;
  if (now_ns < quiet_until_ns_ || sentence == logged_) return;
  logged_ = sentence;
  quiet_until_ns_ = now_ns + kEvery_ns;
  spdlog::warn("{}; the link works on, but times in logs and recordings do not agree: set the clocks (NTP)",
               sentence);
}

}  // namespace phantom::messages
