#include "components/workspace_survey/measurement_file.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <ostream>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/core/units.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ConfigError;

constexpr std::size_t kMaxLines = 10'000, kMaxName = 64;

/// A column's content, and the factor of its unit to SI.
struct Column {
  enum Kind { kFace, kPart, kNode, kRange, kPan, kTilt } kind;
  const char* name;
  double unit;
};
constexpr std::array kColumns{
    Column{Column::kFace, "face", 0},         Column{Column::kPart, "part", 0},
    Column{Column::kNode, "node", 0},         Column{Column::kRange, "range_m", 1},
    Column{Column::kRange, "range_mm", 1e-3}, Column{Column::kPan, "pan_deg", core::kRadPerDegree},
    Column{Column::kPan, "pan_rad", 1},       Column{Column::kTilt, "tilt_deg", core::kRadPerDegree},
    Column{Column::kTilt, "tilt_rad", 1}};
constexpr const char* kAllowed =
    "face, part, node, range_m or range_mm, pan_deg or pan_rad, tilt_deg or tilt_rad";

/// Returns a cell for an error message: short, without characters that a terminal cannot show.
std::string shown(const std::string& cell) {
  std::string text = cell.substr(0, 40);
  for (char& c : text) c = c >= ' ' && c < 127 ? c : '?';
  return "'" + text + (cell.size() > 40 ? "…'" : "'");
}

class Table {
 public:
  explicit Table(std::string name) : name_(std::move(name)) {}

  std::vector<survey::Targeting> read(const std::string& text) {
    std::istringstream lines(text);
    std::vector<survey::Targeting> targetings;
    for (std::string line; std::getline(lines, line);) {
      if (++line_ > kMaxLines) throw error(fmt::format("is one too many; allowed: {} lines", kMaxLines));
      line = core::trimmed(line);
      if (line_ == 1 && line.starts_with("\xEF\xBB\xBF"))
        line = core::trimmed(line.substr(3));  // byte order mark
      if (line.empty() || line.front() == '#') continue;
      if (columns_.empty()) {
        take_head(core::cells_of(line));
      } else {
        targetings.push_back(targeting(core::cells_of(line)));
      }
    }
    if (targetings.empty())
      throw ConfigError(name_ + ": holds no measurement; allowed: a line of columns (" + kAllowed +
                        ") and one per targeting");
    return targetings;
  }

 private:
  ConfigError error(const std::string& problem) const {
    return ConfigError(fmt::format("{}:{}: {}", name_, line_, problem));
  }

  void take_head(const std::vector<std::string>& cells) {
    for (const std::string& cell : cells) {
      const auto column =
          std::find_if(kColumns.begin(), kColumns.end(), [&](const Column& c) { return cell == c.name; });
      if (column == kColumns.end())
        throw error("column " + shown(cell) +
                    " is not known, or has no unit or a wrong one; allowed: " + kAllowed);
      for (const Column& other : columns_) {
        if (other.kind == column->kind)
          throw error("columns " + shown(other.name) + " and " + shown(cell) +
                      " say the same; allowed: one of them");
      }
      columns_.push_back(*column);
    }
    for (const Column& needed : kColumns) {
      const bool there = std::any_of(columns_.begin(), columns_.end(),
                                     [&](const Column& c) { return c.kind == needed.kind; });
      if (!there && needed.kind != Column::kPart)
        throw error(std::string("column '") + needed.name + "' is missing; allowed: " + kAllowed);
    }
  }

  survey::Targeting targeting(const std::vector<std::string>& cells) const {
    if (cells.size() != columns_.size())
      throw error(fmt::format("has {} cells; allowed: {}, as the columns", cells.size(), columns_.size()));
    survey::Targeting t;
    t.place = fmt::format("{}:{}", name_, line_);
    survey::Reading reading;
    int numbers = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Column& column = columns_[i];
      switch (column.kind) {
        case Column::kFace:
          t.face = name_of(column, cells[i]);
          break;
        case Column::kNode:
          t.node = name_of(column, cells[i]);
          break;
        case Column::kPart:
          if (cells[i] != "whole" && cells[i] != "part")
            throw error("part is " + shown(cells[i]) + "; allowed: whole, part");
          t.closed = cells[i] == "whole";
          break;
        default:
          if (cells[i].empty()) continue;
          ++numbers;
          (column.kind == Column::kRange ? reading.range_m
           : column.kind == Column::kPan ? reading.pan_rad
                                         : reading.tilt_rad) = column.unit * number_of(column, cells[i]);
      }
    }
    if (numbers != 0 && numbers != 3)
      throw error(
          "has some of range, pan and tilt; allowed: all three, or none for a node that was measured before");
    if (numbers == 3) t.reading = reading;
    return t;
  }

  std::string name_of(const Column& column, const std::string& cell) const {
    const bool fine =
        !cell.empty() && cell.size() <= kMaxName && cell.front() != '#' &&
        std::all_of(cell.begin(), cell.end(), [](char c) { return c > ' ' && c < 127 && c != '"'; });
    if (!fine)
      throw error(
          fmt::format("{} is {}; allowed: a name of 1 to {} letters, digits and signs, without # in front",
                      column.name, shown(cell), kMaxName));
    return cell;
  }

  double number_of(const Column& column, const std::string& cell) const {
    double value = 0.0;
    const auto [end, problem] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (problem != std::errc() || end != cell.data() + cell.size())
      throw error(fmt::format("{} is {}; allowed: a number, with a point", column.name, shown(cell)));
    if (!std::isfinite(value))
      throw error(fmt::format("{} is {}; allowed: a finite number", column.name, shown(cell)));
    if (column.kind == Column::kRange && !(value > 0))
      throw error(
          fmt::format("{} is {}; allowed: more than 0 (the ranger had no echo?)", column.name, shown(cell)));
    return value;
  }

  std::string name_;
  std::size_t line_ = 0;
  std::vector<Column> columns_;
};

}  // namespace

std::vector<survey::Targeting> read_measurements_text(const std::string& text, const std::string& name) {
  return Table(name).read(text);
}

std::vector<survey::Targeting> read_measurements(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMaxBytes = 4 << 20;
  std::error_code problem;
  if (!std::filesystem::is_regular_file(file, problem))
    throw core::MissingError(file.string() + ": no such file of measurements");
  if (std::filesystem::file_size(file, problem) > kMaxBytes)
    throw ConfigError(file.string() + ": is larger than 4 MiB; allowed: a table of measurements");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw core::MissingError(file.string() + ": cannot be read");
  return read_measurements_text(text.str(), file.string());
}

void write_measurements(std::ostream& out, const std::vector<survey::Targeting>& targetings,
                        const std::string& comment) {
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) out << "# " << line << '\n';
  out << "face,part,node,range_mm,pan_deg,tilt_deg\n";
  for (const survey::Targeting& t : targetings) {
    out << t.face << ',' << (t.closed ? "whole" : "part") << ',' << t.node << ',';
    if (t.reading) {
      out << fmt::format("{:.2f},{:.4f},{:.4f}\n", 1e3 * t.reading->range_m,
                         t.reading->pan_rad / core::kRadPerDegree, t.reading->tilt_rad / core::kRadPerDegree);
    } else {
      out << ",,\n";
    }
  }
}

}  // namespace phantom::workspace_survey
