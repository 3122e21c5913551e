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

/// Closed interval of allowed numbers. `unit` is used in the message only.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  const char* unit = "";
};

/// Strict view of one YAML mapping. Every getter checks type and range and remembers the key. `finish()`
/// refuses keys that no getter has read, and suggests the nearest known key. Every fault is a ConfigError.
///
///     ConfigReader file = ConfigReader::from_file(path);
///     config.rate_hz = file.number("rate_hz", 1000.0, {1, 4000, "Hz"});   // optional, with a default
///     config.mesh = file.text("mesh");                                     // required
///     file.finish();
class ConfigReader {
 public:
  /// Reads a YAML file whose root is a mapping. Throws ConfigError if it is missing or not YAML.
  static ConfigReader from_file(const std::filesystem::path& path);
  /// Reads YAML text. `name` stands for the file's name in messages.
  static ConfigReader from_text(const std::string& yaml, const std::string& name);

  bool has(const std::string& key) const;

  double number(const std::string& key, Range range = {}) const;
  double number(const std::string& key, double fallback, Range range = {}) const;
  int integer(const std::string& key, Range range = {}) const;
  int integer(const std::string& key, int fallback, Range range = {}) const;
  bool flag(const std::string& key, bool fallback) const;
  std::string text(const std::string& key) const;
  std::string text(const std::string& key, const std::string& fallback) const;
  /// Returns one of `allowed`.
  std::string choice(const std::string& key, const std::string& fallback,
                     const std::vector<const char*>& allowed) const;
  std::vector<double> numbers(const std::string& key, Range range = {}) const;
  std::vector<int> integers(const std::string& key, Range range = {}) const;
  std::vector<std::string> texts(const std::string& key) const;
  /// [x, y, z]
  Eigen::Vector3d vector3(const std::string& key) const;
  Eigen::Vector3d vector3(const std::string& key, const Eigen::Vector3d& fallback) const;
  /// Returns the pose {xyz_m: [x, y, z], rpy_deg: [roll, pitch, yaw]}. Both parts are optional; an absent key
  /// gives the identity.
  geometry::Pose pose(const std::string& key) const;
  /// Returns a path, relative to the file's own folder.
  std::filesystem::path path(const std::string& key) const;

  /// Returns a nested mapping. `section` requires it; `optional_section` returns an empty mapping if it is
  /// absent.
  ConfigReader section(const std::string& key) const;
  ConfigReader optional_section(const std::string& key) const;
  /// Returns a sequence of mappings; empty if absent.
  std::vector<ConfigReader> sections(const std::string& key) const;
  /// Returns the mapping's keys in file order, for maps from names to values. Does not mark them as known.
  std::vector<std::string> keys() const;

  /// Refuses keys that no getter has read, here and in every section opened from here.
  void finish() const;

  /// Returns a ConfigError for `key` with file and line: "cell.yaml:12: objects[3].mesh: 'x.stl' <problem>".
  ConfigError error(const std::string& key, const std::string& problem) const;
  /// Returns the place of this mapping: "cell.yaml:12: objects[3]".
  std::string place() const;
  std::filesystem::path file() const;

 private:
  struct Node;
  explicit ConfigReader(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

}  // namespace phantom::runtime
