#pragma once

#include <cmath>
#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// How often the picture of now is to be written into a film of a fixed rate, so that the film keeps time
/// with the clock: one that stands still is repeated, one that comes late is shown late. Knows no clock. Not
/// thread-safe.
class FramePace {
 public:
  /// What is owed beyond this is given up: the film then plays faster there.
  static constexpr double kMostBehind_s = 2.0;

  /// `rate_hz`: frames of the film a second, above 0.
  explicit FramePace(double rate_hz) : rate_hz_(rate_hz) {}

  /// How often to write the picture of `now`, which never goes back; the first call begins the film, with 1.
  int due(core::Nanoseconds now) {
    if (!begun_) start_ = now;
    begun_ = true;
    double owed = core::seconds(now - start_) * rate_hz_ + 1.0 - static_cast<double>(written_);
    if (owed > kMostBehind_s * rate_hz_ + 2.0) {
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
  core::Nanoseconds start_ = 0;  ///< of the film, later by what was given up
  std::uint64_t written_ = 0;
};

}  // namespace phantom::synthetic_viewer
