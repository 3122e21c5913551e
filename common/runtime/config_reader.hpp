#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::runtime {

using core::ConfigError;

/// Closed interval that a number must lie in; `unit` is for the message only.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  const char* unit = "";
};

/// Strict view of one YAML mapping: every getter checks type and range and remembers the key; `finish()`
/// refuses keys that nobody asked for (with the nearest known one as a suggestion). Every fault is a
/// ConfigError.
///
///     ConfigReader file = ConfigReader::from_file(path);
///     config.rate_hz = file.number("rate_hz", 1000.0, {1, 4000, "Hz"});   // optional, with a default
///     config.mesh = file.text("mesh");                                     // required
///     file.finish();
class ConfigReader {
 public:
  /// Reads a YAML file whose root is a mapping. Throws ConfigError if it is missing or not YAML.
  static ConfigReader from_file(const std::filesystem::path& path);
  /// The same from text; `name` stands for the file in messages.
  static ConfigReader from_text(const std::string& yaml, const std::string& name);

  bool has(const std::string& key) const;

  double number(const std::string& key, Range range = {}) const;
  double number(const std::string& key, double fallback, Range range = {}) const;
  int integer(const std::string& key, Range range = {}) const;
  int integer(const std::string& key, int fallback, Range range = {}) const;
  bool flag(const std::string& key, bool fallback) const;
  std::string text(const std::string& key) const;
  std::string text(const std::string& key, const std::string& fallback) const;
  /// One of `allowed`.
  std::string choice(const std::string& key, const std::string& fallback,
                     const std::vector<const char*>& allowed) const;
  std::vector<double> numbers(const std::string& key, Range range = {}) const;
  std::vector<int> integers(const std::string& key, Range range = {}) const;
  std::vector<std::string> texts(const std::string& key) const;
  /// [x, y, z]
  Eigen::Vector3d vector3(const std::string& key) const;
  Eigen::Vector3d vector3(const std::string& key, const Eigen::Vector3d& fallback) const;
  /// {xyz_m: [x, y, z], rpy_deg: [roll, pitch, yaw]}; both parts optional; identity if the key is absent.
  geometry::Pose pose(const std::string& key) const;
  /// A path in the file, taken relative to the file's own folder.
  std::filesystem::path path(const std::string& key) const;

  /// A nested mapping. The one-argument form requires it; `optional_section` gives an empty mapping if
  /// absent.
  ConfigReader section(const std::string& key) const;
  ConfigReader optional_section(const std::string& key) const;
  /// A sequence of mappings; empty if absent.
  std::vector<ConfigReader> sections(const std::string& key) const;
  /// The mapping's keys in file order (for maps from a name to something); marks none as known.
  std::vector<std::string> keys() const;

  /// Refuses keys that no getter asked for, here and in every section that was opened from here.
  void finish() const;

  /// A ConfigError for `key`, with file and line: "cell.yaml:12: objects[3].mesh: 'x.stl' <problem>".
  ConfigError error(const std::string& key, const std::string& problem) const;
  /// Where this mapping stands: "cell.yaml:12: objects[3]".
  std::string place() const;
  std::filesystem::path file() const;

 private:
  struct Node;
  explicit ConfigReader(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

}  // namespace phantom::runtime
