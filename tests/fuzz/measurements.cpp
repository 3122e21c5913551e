// Tables of laser points: whatever their text is, it is read or refused by its place, and what a head could
// have measured is written and read again.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>

#include "common/core/errors.hpp"
#include "common/survey/measurement.hpp"
#include "components/workspace_survey/measurement_file.hpp"

namespace {

using namespace phantom;
using Targetings = std::vector<survey::Targeting>;

void need(bool holds) {
  if (!holds) std::abort();
}

bool near(double a, double b, double last_digit) { return std::abs(a - b) <= 0.501 * last_digit; }

/// What is told of a refused table names the table.
void need_place(const std::string& message) { need(message.starts_with("table:")); }

void need_same(const Targetings& read, const Targetings& again) {
  constexpr double kRange_m = 1e-5, kAngle_rad = 1e-4 * 3.141592653589793 / 180;
  need(read.size() == again.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const survey::Targeting &a = read[i], &b = again[i];
    need(a.face == b.face && a.closed == b.closed && a.node == b.node);
    need(a.reading.has_value() == b.reading.has_value());
    if (!a.reading) continue;
    need(near(a.reading->range_m, b.reading->range_m, kRange_m));
    need(near(a.reading->pan_rad, b.reading->pan_rad, kAngle_rad));
    need(near(a.reading->tilt_rad, b.reading->tilt_rad, kAngle_rad));
  }
}

Targetings written_and_read(const Targetings& read) {
  std::ostringstream text;
  workspace_survey::write_measurements(text, read, "again");
  return workspace_survey::read_measurements_text(text.str(), "written");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  Targetings read;
  try {
    read = workspace_survey::read_measurements_text({reinterpret_cast<const char*>(bytes), size}, "table");
  } catch (const core::ConfigError& refusal) {
    need_place(refusal.what());
    return 0;
  }
  need(!read.empty());
  const auto measurement = survey::register_nodes({}, {}, read);
  if (!measurement) {
    need_place(measurement.status().message());
    return 0;
  }
  for (const survey::MeasuredNode& node : measurement->nodes)
    need(node.p_W_m.allFinite() && node.covariance_m2.allFinite());
  (void)survey::check_measurement(*measurement);
  need_same(read, written_and_read(read));
  return 0;
}
