#include "components/audio_percept/track.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <vector>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"

namespace phantom::audio_percept {
namespace {

using core::ConfigError;

// A CSV track starts at this time, because 0 means that nothing was received yet.
constexpr core::Nanoseconds kBegin_ns = core::kNsPerSecond;

struct Column {
  const char* name;
  bool required;
  double low, high;  // allowed numbers
  double fallback;   // value if the column is missing
};
constexpr double kMax_s = 3600.0, kFar_m = 1000.0;
enum Place { kTime, kCloseness, kSpeed, kX, kY, kZ, kValid, kMuted, kAlert, kLink, kContact };
constexpr std::array<Column, 11> kColumns{{{"t", true, 0, kMax_s, 0},
                                           {"closeness", true, 0, 1, 0},
                                           {"speed_m_s", true, 0, 100, 0},
                                           {"x_m", false, -kFar_m, kFar_m, 0},
                                           {"y_m", false, -kFar_m, kFar_m, 0},
                                           {"z_m", false, -kFar_m, kFar_m, 0},
                                           {"valid", false, 0, 1, 1},
                                           {"muted", false, 0, 1, 0},
                                           {"alert", false, 0, 1, 0},
                                           {"link", false, 0, 3, 0},
                                           {"contact_s", false, -1, kMax_s, -1}}};

/// Returns which column of the file holds which quantity.
std::vector<std::size_t> read_header(const std::string& line, const std::string& where) {
  const std::string allowed =
      "; allowed: t, closeness, speed_m_s and, optional, x_m, y_m, z_m, valid, muted, alert, link, "
      "contact_s";
  std::vector<std::size_t> places;
  for (const std::string& cell : core::cells_of(line)) {
    const auto column =
        std::find_if(kColumns.begin(), kColumns.end(), [&](const Column& c) { return c.name == cell; });
    if (column == kColumns.end()) throw ConfigError(where + "column '" + cell + "' is unknown" + allowed);
    const auto place = static_cast<std::size_t>(column - kColumns.begin());
    if (std::find(places.begin(), places.end(), place) != places.end())
      throw ConfigError(where + "column '" + cell + "' stands twice" + allowed);
    places.push_back(place);
  }
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (kColumns[i].required && std::find(places.begin(), places.end(), i) == places.end())
      throw ConfigError(where + "column '" + kColumns[i].name + "' is missing" + allowed);
  }
  return places;
}

double read_number(const std::string& cell, const Column& column, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() ||
      !(value >= column.low && value <= column.high)) {
    throw ConfigError(
        where + column.name + ": '" + cell +
        core::formatted("' is not a number in the range; allowed: %g to %g", column.low, column.high));
  }
  return value;
}

using Row = std::array<double, kColumns.size()>;

core::Nanoseconds time_of(const Row& row) { return kBegin_ns + core::from_seconds(row[kTime]); }

/// Sets the inputs to those of the row after theirs.
void advance(const Row& row, bool has_link, Inputs& inputs) {
  inputs.now_ns = time_of(row);
  inputs.percept = {{.valid = row[kValid] > 0.5,
                     .closeness = row[kCloseness],
                     .speed_m_s = row[kSpeed],
                     .position_m = {row[kX], row[kY], row[kZ]},
                     .muted_sensors = row[kMuted] > 0.5 ? 1U : 0U},
                    inputs.now_ns};
  if (row[kContact] >= 0.0) {
    inputs.percept.threats.resize(1);
    inputs.percept.threats[0].contact.time_s = row[kContact];
  }
  const bool alert = row[kAlert] > 0.5;
  if (alert && inputs.alerts.active == 0) inputs.alerts.raised_ns = inputs.now_ns;
  inputs.alerts.active = alert ? 1 : 0;
  if (has_link) {
    using teleop::LinkState;
    constexpr std::array kStates{LinkState::kCoupled, LinkState::kDegraded, LinkState::kStopped,
                                 LinkState::kStopped};
    const auto link = static_cast<std::size_t>(row[kLink]);
    inputs.slave.received_ns = inputs.now_ns;
    inputs.slave.state = kStates[link];
    inputs.slave.stop.cause = link == 3 ? teleop::StopCause::kDriveFault : teleop::StopCause::kNone;
  }
}

}  // namespace

Track read_track_csv(std::istream& csv, const std::string& name) {
  std::string line;
  if (!std::getline(csv, line)) throw ConfigError(name + ":1: is empty; a header line is needed");
  const auto places = read_header(line, name + ":1: ");
  const bool has_link = std::find(places.begin(), places.end(), kLink) != places.end();
  std::vector<Row> rows;
  for (int number = 2; std::getline(csv, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string where = name + ":" + std::to_string(number) + ": ";
    const auto cells = core::cells_of(line);
    if (cells.size() != places.size()) {
      throw ConfigError(where + "has " + std::to_string(cells.size()) +
                        " values; allowed: " + std::to_string(places.size()) + ", as the header has");
    }
    Row row{};
    for (std::size_t i = 0; i < kColumns.size(); ++i) row[i] = kColumns[i].fallback;
    for (std::size_t i = 0; i < cells.size(); ++i)
      row[places[i]] = read_number(cells[i], kColumns[places[i]], where);
    if (!rows.empty() && time_of(row) <= time_of(rows.back()))
      throw ConfigError(
          where + "t: " +
          cells[static_cast<std::size_t>(std::find(places.begin(), places.end(), kTime) - places.begin())] +
          " is not later than the row before; allowed: rising times");
    rows.push_back(row);
  }
  if (rows.empty()) throw ConfigError(name + ": holds no rows after its header");
  return [rows = std::move(rows), has_link, next = std::size_t{0}, now = Inputs()](Inputs& inputs) mutable {
    if (next == rows.size()) return false;
    advance(rows[next++], has_link, now);
    inputs = now;
    return true;
  };
}

Track read_track(const std::filesystem::path& file) {
  if (file.extension() != ".csv") return read_track_recording(file);
  std::ifstream csv(file);
  if (!csv) throw core::MissingError(file.string() + ": cannot be read");
  return read_track_csv(csv, file.string());
}

}  // namespace phantom::audio_percept
