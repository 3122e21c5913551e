#include "components/workspace_survey/config.hpp"

#include "common/core/units.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::workspace_survey {
namespace {

using runtime::Fields;

constexpr double kMillimetre = 1e-3;

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  const Fields head = file.section("head");
  config.head.X_WH = head.pose("pose");
  head.number("beam_offset_mm", config.head.beam_offset_m, kMillimetre);
  head.number("min_range_m", config.head.min_range_m);
  head.number("max_range_m", config.head.max_range_m);
  head.check(config.head.max_range_m >= config.head.min_range_m, "max_range_m",
             "is below min_range_m; allowed: that or more");
  const Fields errors = file.section("errors");
  errors.number("range_mm", config.errors.range_m, kMillimetre);
  errors.number("range_mm_per_m", config.errors.range_per_m, kMillimetre);
  errors.number("pan_deg", config.errors.pan_rad, core::kRadPerDegree);
  errors.number("tilt_deg", config.errors.tilt_rad, core::kRadPerDegree);
  errors.number("targeting_mm", config.errors.targeting_m, kMillimetre);
  errors.number("spot_mm", config.errors.spot_m, kMillimetre);
  errors.number("spot_mm_per_m", config.errors.spot_per_m, kMillimetre);
  errors.number("mounting_mm", config.errors.mounting_m, kMillimetre);
  errors.number("mounting_deg", config.errors.mounting_rad, core::kRadPerDegree);
  using enum survey::ErrorLaw;
  errors.choice("law", config.errors.law,
                {{"uniform", kUniform}, {"normal", kNormal}, {"extreme", kExtreme}});
  const auto identify = file.section("identify");
  identify.number("gate_sigmas", config.options.identify.gate_sigmas);
  identify.number("tolerance_mm", config.options.identify.tolerance_m, kMillimetre);
  const auto accept = file.section("accept");
  accept.number("confidence", config.options.confidence);
  accept.number("largest_displacement_mm", config.options.largest_displacement_m, kMillimetre);
  accept.number("least_fit_probability", config.options.least_fit_probability);
  const auto touch = file.section("touch");
  touch.number("sigma_mm", config.touch_sigma_m, kMillimetre);
  touch.number("prior_mm", config.touch.prior_position_sigma_m, kMillimetre);
  touch.number("prior_deg", config.touch.prior_orientation_sigma_rad, core::kRadPerDegree);
  touch.number("normal_cone_deg", config.touch.normal_cone_rad, core::kRadPerDegree);
  touch.number("gate_sigmas", config.touch.gate_sigmas);
  touch.number("determined_mm", config.touch.determined_m, kMillimetre);
  config.touch.confidence = config.options.confidence;
  config.touch.least_fit_probability = config.options.least_fit_probability;
  file.finish();
  return config;
}

}  // namespace phantom::workspace_survey
