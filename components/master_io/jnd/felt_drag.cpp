#include "components/master_io/jnd/felt_drag.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::master_io {

namespace {
constexpr double kMaxGap_s = 0.02;  // a longer gap between samples counts as this
}

void FeltDrag::take(const messages::Received<messages::MasterState>& state) noexcept {
  if (begin_ns_ == 0) begin_ns_ = newest_ns_ = state.received_ns;
  const double dt_s = std::min(core::seconds(state.received_ns - newest_ns_), kMaxGap_s);
  newest_ns_ = state.received_ns;
  const double v = state.velocity[rules_.joint], torque_Nm = state.percept_torque_Nm[rules_.joint];
  const bool felt = state.state == teleop::LinkState::kCoupled && state.percept_enabled;
  if (!felt || since_begin_s() < rules_.settle_s || std::abs(v) < rules_.least_speed) return;
  moved_s_ += dt_s;
  limited_s_ += state.percept_limited ? dt_s : 0.0;
  power_ += torque_Nm * v * dt_s;
  speed2_ += v * v * dt_s;
}

}  // namespace phantom::master_io
