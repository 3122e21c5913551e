#include "common/can/axis_units.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>

#include "common/core/text.hpp"

namespace phantom::can {
namespace {

template <class Integer>
Integer to_integer(double value) noexcept {
  constexpr double kLow = std::numeric_limits<Integer>::min(), kHigh = std::numeric_limits<Integer>::max();
  if (!std::isfinite(value)) return 0;
  return static_cast<Integer>(value <= kLow ? kLow : value >= kHigh ? kHigh : std::round(value));
}

std::string text(double value) { return core::formatted("%g", value); }

struct Positive {
  const char* name;
  double value;
  double most;
};

core::Status check_positive(const std::string& axis, std::initializer_list<Positive> all) {
  for (const Positive& p : all) {
    if (!(p.value > 0.0 && p.value <= p.most))
      return core::Status::invalid_argument(axis + "." + p.name + ": " + text(p.value) +
                                            "; allowed: greater than 0, at most " + text(p.most));
  }
  return core::Status::ok();
}

core::Status check_sensitivity(const AxisUnits& units, const std::string& axis) {
  if (units.takes_voltage())
    return check_positive(axis, {{"torque_sensitivity_Nm_per_V", units.torque_sensitivity_Nm_per_V, 1e3},
                                 {"rated_voltage_V", units.rated_voltage_V, 1e3}});
  return check_positive(axis, {{"torque_constant_Nm_per_A", units.torque_constant_Nm_per_A, 1e3},
                               {"rated_current_A", units.rated_current_A, 1e4}});
}

}  // namespace

std::int32_t AxisUnits::position_counts(double joint) const noexcept {
  return to_integer<std::int32_t>((joint - offset) * counts_per_unit());
}
std::int32_t AxisUnits::velocity_counts(double joint_per_s) const noexcept {
  return to_integer<std::int32_t>(joint_per_s * velocity_per_unit());
}
std::int16_t AxisUnits::torque_mille(double joint_torque) const noexcept {
  return to_integer<std::int16_t>(joint_torque / torque_per_mille());
}

core::Status check_units(const AxisUnits& units, const std::string& axis, double lower, double upper) {
  core::Status status = check_positive(axis, {{"counts_per_turn", units.counts_per_turn, 1e9},
                                              {"gear_ratio", units.gear_ratio, 1e5},
                                              {"travel_per_turn", units.travel_per_turn, 1e3}});
  if (status) status = check_sensitivity(units, axis);
  if (!status) return status;
  if (!(units.velocity_counts_per_turn >= 0.0 && units.velocity_counts_per_turn <= 1e9))
    return core::Status::invalid_argument(
        axis + ".velocity_counts_per_turn: " + text(units.velocity_counts_per_turn) + "; allowed: 0 to 1e9");
  if (units.sign != 1 && units.sign != -1)
    return core::Status::invalid_argument(axis + ".sign: " + std::to_string(units.sign) +
                                          "; allowed: 1 or -1");
  if (!std::isfinite(units.offset))
    return core::Status::invalid_argument(axis + ".offset: " + text(units.offset) +
                                          "; allowed: a finite number");
  for (const double limit : {lower, upper}) {
    const double counts = (limit - units.offset) * units.counts_per_unit();
    if (!(std::abs(counts) < 2147483647.0))
      return core::Status::invalid_argument(axis + ": joint limit " + text(limit) + " is " + text(counts) +
                                            " counts; allowed: within ±2147483647");
  }
  return core::Status::ok();
}

}  // namespace phantom::can
