#include "components/workspace_survey/head/simulated_head.hpp"

#include <spdlog/fmt/fmt.h>

#include <istream>
#include <numbers>
#include <ostream>

#include "components/workspace_survey/head/head_protocol.hpp"

namespace phantom::workspace_survey {
namespace {

const HeadDescription kSimulated{"simulated head", -std::numbers::pi, std::numbers::pi, 0.0,
                                 std::numbers::pi};

std::string aim_reply(survey::SimulatedRanger& ranger, const HeadRequest& request) {
  if (request.pan_rad < kSimulated.min_pan_rad || request.pan_rad > kSimulated.max_pan_rad ||
      request.tilt_rad < kSimulated.min_tilt_rad || request.tilt_rad > kSimulated.max_tilt_rad)
    return error_line(request.id,
                      fmt::format("pan {:.4f}, tilt {:.4f} rad; allowed: pan {:.4f} to {:.4f}, tilt "
                                  "{:.4f} to {:.4f} rad",
                                  request.pan_rad, request.tilt_rad, kSimulated.min_pan_rad,
                                  kSimulated.max_pan_rad, kSimulated.min_tilt_rad, kSimulated.max_tilt_rad));
  return reply_line(request.id, ranger.aim(request.pan_rad, request.tilt_rad));
}

std::string measure_reply(survey::SimulatedRanger& ranger, const HeadRequest& request) {
  std::vector<survey::Reading> readings;
  for (int i = 0; i < request.readings; ++i) {
    const auto reading = ranger.measure();
    if (!reading) return error_line(request.id, reading.status().message());
    readings.push_back(*reading);
  }
  return reply_line(request.id, readings);
}

std::string answer_to(survey::SimulatedRanger& ranger, const std::string& line) {
  const auto request = parse_head_request(line);
  if (!request) return error_line(0, request.status().message());
  switch (request->operation) {
    case HeadOperation::kDescribe:
      return reply_line(request->id, kSimulated);
    case HeadOperation::kAim:
      return aim_reply(ranger, *request);
    case HeadOperation::kMeasure:
      return measure_reply(ranger, *request);
  }
  return error_line(request->id, "no such request");
}

}  // namespace

void run_simulated_head(survey::SimulatedRanger& ranger, std::istream& in, std::ostream& out) {
  for (std::string line; std::getline(in, line);) out << answer_to(ranger, line) << std::endl;
}

}  // namespace phantom::workspace_survey
