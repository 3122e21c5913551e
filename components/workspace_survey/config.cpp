#include "components/workspace_survey/config.hpp"

#include "common/core/units.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr double kMillimetre = 1e-3;

void read_head(const runtime::ConfigReader& reader, survey::RangeHead& head) {
  head.X_WH = reader.pose("pose");
  head.beam_offset_m = kMillimetre * reader.number("beam_offset_mm", 0.0, {0, 500, "mm"});
  head.min_range_m = reader.number("min_range_m", {0.001, 1000, "m"});
  head.max_range_m = reader.number("max_range_m", {head.min_range_m, 1000, "m, min_range_m at least"});
}

void read_errors(const runtime::ConfigReader& reader, survey::HeadErrors& errors) {
  errors.range_m = kMillimetre * reader.number("range_mm", {0.01, 1000, "mm"});
  errors.range_per_m = kMillimetre * reader.number("range_mm_per_m", 0.0, {0, 100, "mm/m"});
  errors.pan_rad = core::kRadPerDegree * reader.number("pan_deg", {1e-5, 10, "deg"});
  errors.tilt_rad = core::kRadPerDegree * reader.number("tilt_deg", {1e-5, 10, "deg"});
  errors.targeting_m = kMillimetre * reader.number("targeting_mm", 0.0, {0, 100, "mm"});
  const std::string law = reader.choice("law", "uniform", {"uniform", "normal", "extreme"});
  errors.law = law == "normal"    ? survey::ErrorLaw::kNormal
               : law == "extreme" ? survey::ErrorLaw::kExtreme
                                  : survey::ErrorLaw::kUniform;
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  Config config;
  read_head(file.section("head"), config.head);
  read_errors(file.section("errors"), config.errors);
  const auto identify = file.optional_section("identify");
  config.options.identify.gate_sigmas = identify.number("gate_sigmas", 4.0, {1, 20, ""});
  config.options.identify.tolerance_m = kMillimetre * identify.number("tolerance_mm", 0.5, {0, 100, "mm"});
  const auto accept = file.optional_section("accept");
  config.options.confidence = accept.number("confidence", 0.99, {0.5, 0.999, ""});
  config.options.largest_displacement_m =
      kMillimetre * accept.number("largest_displacement_mm", 20.0, {0.1, 1000, "mm"});
  config.options.least_fit_probability = accept.number("least_fit_probability", 0.001, {0, 0.5, ""});
  file.finish();
  return config;
}

}  // namespace phantom::workspace_survey
