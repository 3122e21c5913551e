#include "components/wva_server/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "common/core/clock.hpp"
#include "common/core/text.hpp"

namespace phantom::wva_server {
namespace {

constexpr std::int64_t kAfter_ns = 500'000'000, kEvery_ns = 100'000'000;

}  // namespace

std::string bar_text(const std::string& what, double share) {
  constexpr int kWidth = 40;
  const double held = std::clamp(share, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(held * kWidth);
  return what + " [" + std::string(filled, '#') + std::string(kWidth - filled, ' ') +
         core::formatted("] %3d %%", static_cast<int>(held * 100.0));
}

ProgressBar::ProgressBar(std::string what)
    : what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) == 1),
      next_ns_(core::monotonic_ns() + kAfter_ns) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fprintf(stderr, "\r\x1b[K");
}

void ProgressBar::show(double share) {
  if (!terminal_) return;
  const std::int64_t now_ns = core::monotonic_ns();
  if (now_ns < next_ns_) return;
  next_ns_ = now_ns + kEvery_ns;
  drawn_ = true;
  std::fprintf(stderr, "\r%s\x1b[K", bar_text(what_, share).c_str());
  std::fflush(stderr);
}

}  // namespace phantom::wva_server
