#pragma once

#include <cmath>
#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// Computes how often to write the present picture into a video of a fixed rate, so that the video keeps real
/// time: a still picture is repeated, and one that comes late is shown late. It reads no clock. Not
/// thread-safe.
class FramePace {
 public:
  /// A backlog longer than this is dropped: the video then plays faster at that point.
  static constexpr double kMaxBehind_s = 2.0;

  /// `rate_hz`: frames per second of the video, above 0.
  explicit FramePace(double rate_hz) : rate_hz_(rate_hz) {}

  /// Returns how often to write the picture at time `now`, which must not go back. The first call starts the
  /// video and returns 1.
  int due(core::Nanoseconds now) {
    if (!begun_) start_ = now;
    begun_ = true;
    double owed = core::seconds(now - start_) * rate_hz_ + 1.0 - static_cast<double>(written_);
    if (owed > kMaxBehind_s * rate_hz_ + 2.0) {
      const double given_up = std::floor(owed - 1.0);
      start_ += core::from_seconds(given_up / rate_hz_);
      owed -= given_up;
    }
    const int frames = owed < 1.0 ? 0 : static_cast<int>(owed);
    written_ += static_cast<std::uint64_t>(frames);
    return frames;
  }

 private:
  double rate_hz_;
  bool begun_ = false;
  core::Nanoseconds start_ = 0;  ///< start of the video, moved later by the dropped backlog
  std::uint64_t written_ = 0;
};

}  // namespace phantom::synthetic_viewer
