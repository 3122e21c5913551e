#include "tests/experiments/report.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace phantom::experiments {
namespace {

std::string text_of(double value) {
  if (!std::isfinite(value)) return "";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

/// As RFC 4180 wants a field with commas.
std::string quoted(const std::string& text) {
  return text.find(',') == std::string::npos ? text : '"' + text + '"';
}

std::string csv(const Table& table) {
  std::string text;
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    if (i > 0) text += ',';
    text += quoted(table.columns()[i]);
  }
  text += '\n';
  for (const auto& row : table.rows()) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i > 0) text += ',';
      text += text_of(row[i]);
    }
    text += '\n';
  }
  return text;
}

const char* name_of(Style style) {
  switch (style) {
    case Style::kLine:
      return "line";
    case Style::kDashed:
      return "dashed";
    case Style::kPoints:
      return "points";
    case Style::kStep:
      return "step";
    case Style::kBars:
      return "bars";
  }
  return "";
}

}  // namespace

void Table::row(std::vector<double> values) {
  if (values.size() != columns_.size()) {
    throw std::logic_error("table " + name_ + ": a row of " + std::to_string(values.size()) + " values for " +
                           std::to_string(columns_.size()) + " columns");
  }
  rows_.push_back(std::move(values));
}

bool Table::has_column(const std::string& column) const {
  return std::find(columns_.begin(), columns_.end(), column) != columns_.end();
}

Panel& Panel::add(std::string kind, std::string label, const Table& table,
                  std::vector<std::pair<std::string, std::string>> columns) {
  for (const auto& [role, column] : columns) {
    if (!table.has_column(column))
      throw std::logic_error("table " + table.name() + " has no column '" + column + "'");
  }
  series_.push_back({std::move(kind), std::move(label), &table, std::move(columns)});
  return *this;
}

Panel& Panel::series(const Table& table, const std::string& x, const std::string& y, const std::string& label,
                     Style style) {
  return add(name_of(style), label, table, {{"x", x}, {"y", y}});
}

Panel& Panel::map(const Table& table, const std::string& x, const std::string& y, const std::string& value,
                  const std::string& label) {
  return add("map", label, table, {{"x", x}, {"y", y}, {"value", value}});
}

Panel& Panel::arrows(const Table& table, const std::string& x, const std::string& y, const std::string& u,
                     const std::string& v, const std::string& label) {
  return add("arrows", label, table, {{"x", x}, {"y", y}, {"u", u}, {"v", v}});
}

Panel& Panel::vertical(double at, const std::string& label) { return vertical_band(at, at, label); }
Panel& Panel::horizontal(double at, const std::string& label) { return horizontal_band(at, at, label); }

Panel& Panel::vertical_band(double from, double to, const std::string& label) {
  marks_.push_back({"x", label, from, to});
  return *this;
}

Panel& Panel::horizontal_band(double from, double to, const std::string& label) {
  marks_.push_back({"y", label, from, to});
  return *this;
}

Panel& Panel::names_x(std::vector<std::string> names) {
  names_x_ = std::move(names);
  return *this;
}

Panel& Panel::range_x(double low, double high) {
  range_x_ = {low, high};
  return *this;
}

Panel& Panel::range_y(double low, double high) {
  range_y_ = {low, high};
  return *this;
}

Panel& Panel::log_x() {
  log_x_ = true;
  return *this;
}

Panel& Panel::log_y() {
  log_y_ = true;
  return *this;
}

Panel& Panel::equal_axes() {
  equal_ = true;
  return *this;
}

nlohmann::json Panel::json() const {
  nlohmann::json panel{{"title", title_},
                       {"x", x_label_},
                       {"y", y_label_},
                       {"names_x", names_x_},
                       {"range_x", range_x_},
                       {"range_y", range_y_},
                       {"log_x", log_x_},
                       {"log_y", log_y_},
                       {"equal", equal_},
                       {"series", nlohmann::json::array()},
                       {"marks", nlohmann::json::array()}};
  for (const Series& s : series_) {
    nlohmann::json series{{"kind", s.kind}, {"label", s.label}, {"table", s.table->name()}};
    for (const auto& [role, column] : s.columns) series[role] = column;
    panel["series"].push_back(series);
  }
  for (const Mark& mark : marks_) {
    panel["marks"].push_back(
        {{"axis", mark.axis}, {"from", mark.from}, {"to", mark.to}, {"label", mark.label}});
  }
  return panel;
}

nlohmann::json Plot::json() const {
  nlohmann::json plot{
      {"name", name_}, {"title", title_}, {"columns", columns_}, {"panels", nlohmann::json::array()}};
  for (const Panel& panel : panels_) plot["panels"].push_back(panel.json());
  return plot;
}

namespace {

nlohmann::json json_of(const Check& check) {
  return {{"what", check.what}, {"value", check.value}, {"low", check.low},
          {"high", check.high}, {"unit", check.unit},   {"passed", check.passed()}};
}

}  // namespace

Report::Report(std::filesystem::path folder) : folder_(std::move(folder)) {}

Table& Report::table(const std::string& name, std::vector<std::string> columns) {
  for (const Table& table : tables_) {
    if (table.name() == name) throw std::logic_error("two tables are called " + name);
  }
  return tables_.emplace_back(name, std::move(columns));
}

Plot& Report::plot(const std::string& name, const std::string& title, int columns) {
  for (const Plot& plot : plots_) {
    if (plot.name_ == name) throw std::logic_error("two plots are called " + name);
  }
  return plots_.emplace_back(name, title, columns);
}

void Report::check(const std::string& what, double value, double low, double high, const std::string& unit) {
  checks_.push_back({what, value, low, high, unit});
}

void Report::beside(const std::string& what, const std::string& place, double thesis, double ours, double low,
                    double high, const std::string& unit) {
  if (!(low <= high) || (std::isinf(low) && std::isinf(high)))
    throw std::logic_error("beside the thesis: " + what + ": the band excludes nothing, or everything");
  printed_.push_back({{what, ours, low, high, unit}, place, thesis});
}

void Report::prints_no_more(const std::string& text) { prints_no_more_.push_back(text); }

void Report::difference(const std::string& text) { differences_.push_back(text); }

void Report::picture(const std::string& file, const std::string& caption) {
  pictures_.emplace_back(file, caption);
}

std::vector<Check> Report::failed() const {
  std::vector<Check> failed;
  for (const Check& check : checks_)
    if (!check.passed()) failed.push_back(check);
  for (const Printed& printed : printed_)
    if (!printed.check.passed()) failed.push_back(printed.check);
  return failed;
}

bool Report::passed() const { return checks_.size() + printed_.size() > 0 && failed().empty(); }

void Report::write() const {
  std::filesystem::create_directories(folder_);
  for (const Table& table : tables_) write_file(folder_ / (table.name() + ".csv"), csv(table));
  nlohmann::json plots = nlohmann::json::array(), pictures = nlohmann::json::array(),
                 checks = nlohmann::json::array();
  for (const Plot& plot : plots_) plots.push_back(plot.json());
  for (const auto& [file, caption] : pictures_) pictures.push_back({{"file", file}, {"caption", caption}});
  for (const Check& check : checks_) checks.push_back(json_of(check));
  for (const auto& [check, place, thesis] : printed_) {
    checks.push_back(json_of(check));
    checks.back()["place"] = place;
    checks.back()["thesis"] = thesis;
  }
  write_file(folder_ / "plots.json", nlohmann::json{{"plots", plots},
                                                    {"pictures", pictures},
                                                    {"prints_no_more", prints_no_more_},
                                                    {"differences", differences_}}
                                             .dump(1) +
                                         "\n");
  write_file(folder_ / "checks.json", checks.dump(1) + "\n");
}

}  // namespace phantom::experiments
