#include "components/workspace_survey/head/head_steering.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "common/core/units.hpp"

namespace phantom::workspace_survey {
namespace {

using survey::Reading;

// Readings of one place differ by twice the bound of their errors at most; the rest is for the head's jitter.
constexpr double kSpread_bounds = 3.0;

}  // namespace

HeadSteering::HeadSteering(SteeredHead& head, const survey::RangeHead& mounted,
                           const survey::HeadErrors& errors, int readings, std::ostream& out)
    : head_(head), mounted_(mounted), errors_(errors), readings_(readings), out_(out) {
  const HeadDescription& d = head_.description();
  out_ << fmt::format(
      "Head: {}, pan {:.0f} to {:.0f} deg, tilt {:.0f} to {:.0f} deg. aim, jog and next turn it; "
      "measure takes a corner.\n",
      d.driver, d.min_pan_rad / core::kRadPerDegree, d.max_pan_rad / core::kRadPerDegree,
      d.min_tilt_rad / core::kRadPerDegree, d.max_tilt_rad / core::kRadPerDegree);
}

std::optional<std::pair<double, double>> HeadSteering::angles_in(std::istringstream& words,
                                                                 const char* usage) {
  double pan_deg = 0.0, tilt_deg = 0.0;
  std::string rest;
  if (!(words >> pan_deg >> tilt_deg) || words >> rest || !std::isfinite(pan_deg + tilt_deg)) {
    out_ << "  needs two angles in degrees: " << usage << '\n';
    return std::nullopt;
  }
  return std::pair{core::kRadPerDegree * pan_deg, core::kRadPerDegree * tilt_deg};
}

void HeadSteering::aim(std::istringstream& words) {
  if (const auto angles = angles_in(words, "aim PAN TILT")) turn(angles->first, angles->second);
}

void HeadSteering::jog(std::istringstream& words) {
  const auto angles = angles_in(words, "jog DPAN DTILT");
  if (!angles) return;
  if (!pointing_) {
    out_ << "  the head was not aimed yet; aim it first\n";
    return;
  }
  turn(pointing_->pan_rad + angles->first, pointing_->tilt_rad + angles->second);
}

bool HeadSteering::aim_at(const Eigen::Vector3d& p_W_m) {
  const auto wanted = survey::aim(mounted_, p_W_m);
  if (wanted) return turn(wanted->pan_rad, wanted->tilt_rad);
  out_ << "  the head cannot aim there: " << wanted.status().message() << '\n';
  return false;
}

bool HeadSteering::turn(double pan_rad, double tilt_rad) {
  const HeadDescription& d = head_.description();
  if (pan_rad < d.min_pan_rad || pan_rad > d.max_pan_rad || tilt_rad < d.min_tilt_rad ||
      tilt_rad > d.max_tilt_rad) {
    out_ << fmt::format(
        "  the head does not reach pan {:.3f} deg, tilt {:.3f} deg; allowed: pan {:.1f} to {:.1f} "
        "deg, tilt {:.1f} to {:.1f} deg\n",
        pan_rad / core::kRadPerDegree, tilt_rad / core::kRadPerDegree, d.min_pan_rad / core::kRadPerDegree,
        d.max_pan_rad / core::kRadPerDegree, d.min_tilt_rad / core::kRadPerDegree,
        d.max_tilt_rad / core::kRadPerDegree);
    return false;
  }
  const auto stands = head_.aim(pan_rad, tilt_rad);
  if (!stands) {
    pointing_.reset();
    out_ << "  " << stands.status().message() << '\n';
    return false;
  }
  pointing_ = *stands;
  out_ << fmt::format("  the head stands at pan {:.4f} deg, tilt {:.4f} deg\n",
                      stands->pan_rad / core::kRadPerDegree, stands->tilt_rad / core::kRadPerDegree);
  return true;
}

std::optional<Reading> HeadSteering::measure() {
  if (!pointing_) {
    out_ << "  the head was not aimed yet; aim it first\n";
    return std::nullopt;
  }
  const auto readings = head_.measure(readings_);
  if (!readings) {
    out_ << "  " << readings.status().message() << '\n';
    return std::nullopt;
  }
  Reading mean;
  for (const Reading& reading : *readings) {
    mean.range_m += reading.range_m / readings_;
    mean.pan_rad += reading.pan_rad / readings_;
    mean.tilt_rad += reading.tilt_rad / readings_;
  }
  const auto [least, most] = std::ranges::minmax_element(*readings, {}, &Reading::range_m);
  const double spread_m = most->range_m - least->range_m,
               allowed_m = kSpread_bounds * survey::range_bound_m(errors_, mean);
  if (spread_m > allowed_m) {
    out_ << fmt::format(
        "  refused: {} readings differ by {:.1f} mm (allowed: {:.1f} mm), as over an edge, with "
        "the background behind it; aim so that the whole spot is on the face\n",
        readings_, 1e3 * spread_m, 1e3 * allowed_m);
    return std::nullopt;
  }
  out_ << fmt::format("  the head reads {:.1f} {:.4f} {:.4f}\n", 1e3 * mean.range_m,
                      mean.pan_rad / core::kRadPerDegree, mean.tilt_rad / core::kRadPerDegree);
  return mean;
}

}  // namespace phantom::workspace_survey
