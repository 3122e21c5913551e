#include "common/teleop/gripper/gripper.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

double near(double reference_m, double width_m) noexcept {
  return std::clamp(reference_m, width_m - GripperControl::kLead_m, width_m + GripperControl::kLead_m);
}

}  // namespace

GripperControl::GripperControl(const GripperLimits& limits) noexcept : limits_(limits) {
  status_.requested_force_N = limits.usual_force_N;
}

void GripperControl::take(const GripperRequest& request) noexcept {
  if (request.force_number != force_number_) {
    force_number_ = request.force_number;
    if (std::isfinite(request.force_N))
      status_.requested_force_N =
          std::clamp(request.force_N, limits_.least_force_N, limits_.greatest_force_N);
  }
  if (request.width_number == width_number_) return;
  width_number_ = request.width_number;
  if (!std::isfinite(request.width_m)) return;
  const double width_m = std::clamp(request.width_m, 0.0, limits_.widest_m);
  const double at_m = status_.sense.width_m;
  const bool same_way = (width_m < at_m) == (status_.requested_width_m < at_m);
  if (!same_way) {  // it lets go
    pressed_s_ = 0.0;
    status_.holds = pressing_ = false;
  }
  status_.requested_width_m = width_m;
  waiting_ = true;
}

void GripperControl::halt() noexcept {
  waiting_ = false;
  if (pressing_ || status_.holds || !status_.sense.known) return;
  status_.requested_width_m = std::clamp(reference_m_, 0.0, limits_.widest_m);
}

// The drive begins to follow: at first, or after a fault. A grip is resumed at once, all else stays.
void GripperControl::begin(const GripperSense& sense) noexcept {
  const bool still = std::abs(sense.velocity_m_s) < kStill_m_s;
  const bool taken_over = !begun_ && !waiting_ && still && sense.force_N >= limits_.least_force_N;
  if (taken_over) {
    status_.requested_width_m = 0.0;
    status_.requested_force_N = std::min(sense.force_N, limits_.greatest_force_N);
  } else if (!waiting_ && !status_.holds) {
    status_.requested_width_m = std::clamp(sense.width_m, 0.0, limits_.widest_m);
  }
  reference_m_ = sense.width_m;
  if (taken_over || status_.holds) reference_m_ = near(status_.requested_width_m, sense.width_m);
}

// Decides whether the fingers hold something.
void GripperControl::assess(const GripperSense& sense, double dt_s) noexcept {
  const double way_m = status_.requested_width_m - sense.width_m;
  const double along_N = way_m < 0.0 ? sense.force_N : -sense.force_N;
  const bool still = std::abs(sense.velocity_m_s) < kStill_m_s;
  status_.moves = !still;
  pressing_ =
      still && std::abs(way_m) > kTolerance_m && along_N >= kPressingShare * status_.requested_force_N;
  pressed_s_ = std::clamp(pressed_s_ + (pressing_ ? dt_s : -dt_s), 0.0, kHeldAfter_s);
  if (pressed_s_ >= kHeldAfter_s) status_.holds = true;
  if (pressed_s_ <= 0.0) status_.holds = false;
  status_.open = sense.width_m >= limits_.widest_m - kTolerance_m;
  status_.closed = sense.width_m <= kTolerance_m;
}

GripperDemand GripperControl::step(const GripperSense& sense, const GripperRequest& request,
                                   double dt_s) noexcept {
  const bool sound =
      std::isfinite(sense.width_m) && std::isfinite(sense.velocity_m_s) && std::isfinite(sense.force_N);
  const bool followed = status_.sense.follows;
  if (sound) status_.sense = sense;
  status_.sense.known = sense.known && sound;
  status_.sense.follows = sense.follows && status_.sense.known;
  status_.sense.fault = sense.fault;
  take(request);
  if (!status_.sense.follows) {
    reference_m_ = status_.sense.width_m;
    pressing_ = status_.moves = false;
    return {reference_m_, status_.requested_force_N};
  }
  if (!followed) begin(sense);
  begun_ = true;
  waiting_ = false;
  assess(sense, dt_s);
  const double most_m = limits_.max_speed_m_s * std::max(dt_s, 0.0);
  reference_m_ += std::clamp(status_.requested_width_m - reference_m_, -most_m, most_m);
  reference_m_ = near(reference_m_, sense.width_m);
  return {std::clamp(reference_m_, 0.0, limits_.widest_m), status_.requested_force_N};
}

}  // namespace phantom::teleop
