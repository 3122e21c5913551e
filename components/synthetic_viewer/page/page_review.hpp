#pragma once

#include <string>
#include <vector>

#include "components/synthetic_viewer/review/review.hpp"

namespace phantom::synthetic_viewer {

/// Returns the response to GET /review: what the recording has, as long as it is shown. Times are in s from
/// its beginning.
std::string review_json(const Review& review);

/// What of the series is asked for.
struct SeriesRequest {
  std::vector<std::string> names;
  double from_s = 0.0, to_s = 0.0;
  std::size_t columns = 0;
  static constexpr std::size_t kMaxColumns = 4000;
};
/// Parses the parameters of GET /review/series: names (separated by commas), from, to, columns. An empty text
/// is a missing one. The error message says what is wrong and what is allowed.
core::Expected<SeriesRequest> parse_series_request(const std::string& names, const std::string& from,
                                                   const std::string& to, const std::string& columns);
/// Returns the response to it: of each series the least and the greatest value in each column, null where
/// there is none. Fails if there is no such series.
core::Expected<std::string> series_json(const Review& review, const SeriesRequest& request);

/// Parses what the page posts to /review: {"t": 12.5, "play": true, "rate": 1}. Each may be omitted. The
/// error message says what is wrong and what is allowed.
core::Expected<ReviewRequest> parse_review_request(const std::string& json);

/// Why nothing can be commanded while a recording is shown.
inline constexpr const char* kRecordingTakesNoCommands =
    "this is a recording: the page has no arm to stop or command; allowed: what moves, holds "
    "or chooses a view";

}  // namespace phantom::synthetic_viewer
