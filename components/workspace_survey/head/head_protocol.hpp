#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/survey/range_head.hpp"

namespace phantom::workspace_survey {

// The contract between workspace_survey and the driver of a pan–tilt range head, an executable: one JSON
// object per line on the driver's standard input, each answered by one on its standard output
// (docs/range_head.md). Angles are those of survey::Reading, in rad; ranges in m.

inline constexpr int kHeadContract = 1;                 ///< the contract's version
inline constexpr std::size_t kMaxHeadLine = 64 * 1024;  ///< bytes of a line
inline constexpr int kMaxHeadReadings = 100;            ///< of one measure
/// A head stands no farther from where it was sent, along each angle, or answers with an error.
inline constexpr double kHeadTolerance_rad = 0.0017453;  // 0.1 degrees

enum class HeadOperation { kDescribe, kAim, kMeasure };
const char* name_of(HeadOperation operation);

/// A request to the driver.
struct HeadRequest {
  std::uint64_t id = 0;  ///< echoed by the reply
  HeadOperation operation = HeadOperation::kDescribe;
  double pan_rad = 0.0, tilt_rad = 0.0;  ///< aim
  int readings = 1;                      ///< measure
};

/// What a driver says of its head.
struct HeadDescription {
  std::string driver;  ///< its name, for a person
  double min_pan_rad = 0.0, max_pan_rad = 0.0, min_tilt_rad = 0.0, max_tilt_rad = 0.0;
};

/// The driver's end. Lines have no end-of-line character.
core::Expected<HeadRequest> parse_head_request(const std::string& line);
std::string reply_line(std::uint64_t id, const HeadDescription& description);
std::string reply_line(std::uint64_t id, const survey::Reading& direction);  ///< aim: range_m is left out
std::string reply_line(std::uint64_t id, const std::vector<survey::Reading>& readings);
std::string error_line(std::uint64_t id, const std::string& problem);

/// The other end. A reply is checked whole: that it is an object, of this request, that its numbers are
/// finite and in the ranges stated. Errors say what is wrong and what is allowed; the driver's own errors
/// come as kUnavailable, in one printable line.
std::string request_line(const HeadRequest& request);
/// Returns the id of a reply, to tell late ones; an error if it is no reply at all.
core::Expected<std::uint64_t> reply_id(const std::string& line);
core::Expected<HeadDescription> parse_description(const std::string& line);
/// `asked`: where the head was sent.
core::Expected<survey::Reading> parse_direction(const std::string& line, const survey::Reading& asked);
/// `pointing`: where the head stands; `head`: whose ranges are allowed; `count`: of readings asked for.
core::Expected<std::vector<survey::Reading>> parse_readings(const std::string& line,
                                                            const survey::RangeHead& head,
                                                            const survey::Reading& pointing, int count);

}  // namespace phantom::workspace_survey
