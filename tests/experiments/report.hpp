#pragma once

#include <filesystem>
#include <list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

namespace phantom::experiments {

/// A figure that an experiment measured and the band in which it must lie.
struct Check {
  std::string what;
  double value = 0.0, low = 0.0, high = 0.0;
  std::string unit;
  /// low ≤ value ≤ high; not a number fails.
  bool passed() const { return value >= low && value <= high; }
};

/// A figure that the thesis prints, and ours, which must lie in the check's band.
struct Printed {
  Check check;
  std::string place;
  double thesis;
};

/// Rows of numbers; column names carry the unit: "distance [mm]".
class Table {
 public:
  Table(std::string name, std::vector<std::string> columns)
      : name_(std::move(name)), columns_(std::move(columns)) {}
  /// Appends a row. Throws std::logic_error unless it has as many values as there are columns. A value that
  /// is not a number is a gap in a plotted line.
  void row(std::vector<double> values);
  const std::string& name() const { return name_; }
  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<std::vector<double>>& rows() const { return rows_; }
  bool has_column(const std::string& column) const;

 private:
  std::string name_;
  std::vector<std::string> columns_;
  std::vector<std::vector<double>> rows_;
};

/// How a series is drawn. kStep holds each value until the next point.
enum class Style { kLine, kDashed, kPoints, kStep, kBars };

/// One pair of axes of a plot.
class Panel {
 public:
  Panel(std::string title, std::string x_label, std::string y_label)
      : title_(std::move(title)), x_label_(std::move(x_label)), y_label_(std::move(y_label)) {}
  /// `y` over `x`, columns of the table. With kBars `x` numbers the groups of bars; names_x() may name them.
  Panel& series(const Table& table, const std::string& x, const std::string& y, const std::string& label,
                Style style = Style::kLine);
  /// Coloured cells at (x, y) of a regular grid: a section through voxels.
  Panel& map(const Table& table, const std::string& x, const std::string& y, const std::string& value,
             const std::string& label);
  /// Arrows (u, v) at (x, y).
  Panel& arrows(const Table& table, const std::string& x, const std::string& y, const std::string& u,
                const std::string& v, const std::string& label);
  Panel& vertical(double at, const std::string& label);
  Panel& horizontal(double at, const std::string& label);
  Panel& vertical_band(double from, double to, const std::string& label);
  Panel& horizontal_band(double from, double to, const std::string& label);
  Panel& names_x(std::vector<std::string> names);  ///< in place of the numbers 0, 1, 2…
  Panel& range_x(double low, double high);
  Panel& range_y(double low, double high);
  Panel& log_x();
  Panel& log_y();
  Panel& equal_axes();  ///< one metre is as long on both

 private:
  friend class Plot;
  struct Series {
    std::string kind, label;
    const Table* table;
    std::vector<std::pair<std::string, std::string>> columns;  // role, column
  };
  struct Mark {
    std::string axis, label;
    double from, to;
  };
  Panel& add(std::string kind, std::string label, const Table& table,
             std::vector<std::pair<std::string, std::string>> columns);
  nlohmann::json json() const;

  std::string title_, x_label_, y_label_;
  std::vector<Series> series_;
  std::vector<Mark> marks_;
  std::vector<std::string> names_x_;
  std::vector<double> range_x_, range_y_;
  bool log_x_ = false, log_y_ = false, equal_ = false;
};

/// A figure of one or several panels, drawn by draw.py as NAME.svg. The title names the parameters.
class Plot {
 public:
  Plot(std::string name, std::string title, int columns)
      : name_(std::move(name)), title_(std::move(title)), columns_(columns) {}
  /// Labels with their units: "distance [mm]". The reference stays valid.
  Panel& panel(std::string title, std::string x_label, std::string y_label) {
    return panels_.emplace_back(std::move(title), std::move(x_label), std::move(y_label));
  }

 private:
  friend class Report;
  nlohmann::json json() const;
  std::string name_, title_;
  int columns_;
  std::list<Panel> panels_;
};

/// What one experiment leaves: tables (CSV), plots (plots.json), checks (checks.json), in a folder of its
/// own.
class Report {
 public:
  explicit Report(std::filesystem::path folder);
  const std::filesystem::path& folder() const { return folder_; }

  /// References stay valid. Names are file names without ending, each once: std::logic_error otherwise.
  Table& table(const std::string& name, std::vector<std::string> columns);
  /// `columns`: panels side by side.
  Plot& plot(const std::string& name, const std::string& title, int columns = 1);
  /// The first check is the one that the summary shows.
  void check(const std::string& what, double value, double low, double high, const std::string& unit);
  /// Judges a figure that the thesis prints: ours must lie in low … high. Where ours differs, the band lies
  /// round what ours must be, and difference() says why. `place`: where it stands, "table 3.3, page 68".
  /// Throws std::logic_error for a band that excludes nothing, or everything.
  void beside(const std::string& what, const std::string& place, double thesis, double ours, double low,
              double high, const std::string& unit);
  /// Says that the thesis prints nothing more to lay beside ours, and what its pages hold instead.
  void prints_no_more(const std::string& text);
  /// Where ours differs from the thesis, and why; for the page.
  void difference(const std::string& text);
  /// A picture (PNG) that the experiment wrote into folder(), for the page.
  void picture(const std::string& file, const std::string& caption);

  const std::vector<Check>& checks() const { return checks_; }
  const std::vector<Printed>& printed() const { return printed_; }
  std::vector<Check> failed() const;  ///< of the checks and of what is beside the thesis
  bool passed() const;                ///< at least one check or figure of the thesis, and all pass
  /// Writes the files. Throws std::runtime_error if one cannot be written.
  void write() const;

 private:
  std::filesystem::path folder_;
  std::list<Table> tables_;
  std::list<Plot> plots_;
  std::vector<Check> checks_;
  std::vector<Printed> printed_;
  std::vector<std::string> differences_, prints_no_more_;
  std::vector<std::pair<std::string, std::string>> pictures_;
};

}  // namespace phantom::experiments
