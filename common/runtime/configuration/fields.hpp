#pragma once

#include <Eigen/Core>
#include <cmath>
#include <concepts>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/errors.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::runtime {

using core::ConfigError;

/// Allowed values of a field, from a table of keys.
struct FieldSpec {
  bool required = false;
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
  std::string unit;
  std::vector<std::string> names;  ///< allowed names of a choice, or alternatives to this key

  /// Returns what is allowed of a number, as "1 to 1000 mm".
  std::string range() const;
};

/// Table of the keys of a YAML file, made from a YAML text with comments. The comment after a key gives in
/// brackets what is allowed, then what the key means:
///
///     measure_s: 5       # [0.1 to 600 s] how long hz and latency listen
///     mode: continuous   # [continuous, on_event]
///     name: part         # [required: 1 to 64 bytes]
///     mesh: part.stl     # [or: primitive, csg] another key of which an object has exactly one
///     # hand:            # may be left out, and is
///     #   node: 1        # [required: 1 to 127]
///
/// "; left out: 3" at the end of the brackets is for people: the value that applies without the key, if not
/// the value shown. Keys are dotted: hand.node; drives[].node of each item of a list; joints.NAME.k_p of any
/// name. A text for parameters is the shipped file itself. In a text for files that a user writes, the keys
/// at the left name kinds of sections, which may stand in several places (Fields::as).
class FieldTable {
 public:
  /// Reads the table from one or more texts, one after the other.
  FieldTable(std::initializer_list<const char*> yaml);
  /// Returns the field's specification. Throws std::logic_error if the table has no such key.
  const FieldSpec& at(const std::string& key) const;

 private:
  std::shared_ptr<const std::map<std::string, FieldSpec>> specs_;
};

/// Strict view of one mapping of a YAML file, read by a table of keys. Each call names the key and the member
/// that receives its value. The table decides what is allowed. An absent key leaves the member unchanged
/// unless the table requires it. finish() refuses keys that nothing has read. Every fault of the file is a
/// ConfigError with file, line, key, value and what is allowed; a file that cannot be read is a MissingError,
/// and a key that is not in the table a std::logic_error.
///
///     Fields file(path, {kParameters});
///     file.number("measure_s", config.measure_s);
///     file.section("page").flag("enabled", config.page.enabled);
///     file.finish();
class Fields {
 public:
  /// Reads a file whose root is a mapping.
  Fields(const std::filesystem::path& file, const FieldTable& table);
  /// Reads a text. `name` stands for the file's name in messages.
  static Fields from_text(const std::string& yaml, const std::string& name, const FieldTable& table);
  /// Returns the same mapping, to be read as a section of kind `kind` of the table.
  Fields as(const std::string& kind) const { return {node_, table_, kind + "."}; }

  /// Returns whether the key is there and has a value. Marks it as known.
  bool has(const std::string& key) const;
  /// Reads a number. `scale` converts the key's unit to the member's, e.g. 1e-3 for a key in mm and a member
  /// in m. An integral member accepts whole numbers only, unless it is scaled.
  template <class T>
  void number(const std::string& key, T& value, double scale = 1.0) const {
    const auto read = number_of(key, std::integral<T> && scale == 1.0);
    if (!read) return;
    if constexpr (std::integral<T>) {
      value = static_cast<T>(std::llround(*read * scale));
    } else {
      value = static_cast<T>(*read * scale);
    }
  }
  /// Returns the number, or `fallback` if the key is absent.
  double value(const std::string& key, double fallback = 0.0) const {
    number(key, fallback);
    return fallback;
  }
  void flag(const std::string& key, bool& value) const;
  /// Reads a text, or a path that is not made relative to the file's folder. A range in bytes limits its
  /// length.
  template <class T>
  void text(const std::string& key, T& value) const {
    if (auto read = text_of(key)) value = std::move(*read);
  }
  /// Returns the text; empty if the key is absent.
  std::string text(const std::string& key) const { return text_of(key).value_or(""); }
  /// Reads one of the names in `all`, which must be those of the table, and assigns the value paired with it.
  template <class T>
  void choice(const std::string& key, T& value,
              const std::vector<std::pair<const char*, std::type_identity_t<T>>>& all) const {
    std::vector<std::string> names;
    for (const auto& one : all) names.emplace_back(one.first);
    if (const auto chosen = chosen_of(key, names)) value = all[*chosen].second;
  }
  /// Returns which of `key` and its alternatives in the table the mapping has. If it has none, returns an
  /// empty text, or refuses the mapping as one without a `noun`.
  std::string one_of(const std::string& key, const std::string& noun = "") const;
  void numbers(const std::string& key, std::vector<double>& values) const;
  void numbers(const std::string& key, std::vector<int>& values) const;
  /// Reads a mapping of any names to numbers.
  void numbers(const std::string& key, std::map<std::string, double>& values) const;
  void texts(const std::string& key, std::vector<std::string>& values) const;
  /// [x, y, z]
  template <class T>
  void vector3(const std::string& key, T& value) const {
    if (const auto read = vector3_of(key)) value = {read->x(), read->y(), read->z()};
  }
  /// Reads a number that holds for all axes, or one for each, [x, y, z].
  void axes(const std::string& key, Eigen::Vector3d& value) const;
  Eigen::Vector3d vector3(const std::string& key) const {
    return vector3_of(key).value_or(Eigen::Vector3d::Zero());
  }
  /// Returns the pose {xyz_m: [x, y, z], rpy_deg: [roll, pitch, yaw]}. Both parts are optional; an absent key
  /// gives the identity.
  geometry::Pose pose(const std::string& key) const;
  /// Returns the path, made relative to the file's own folder; empty if the key is absent.
  std::filesystem::path path(const std::string& key) const;
  /// As path(), of a file that must exist. Throws core::MissingError if it does not.
  std::filesystem::path existing_file(const std::string& key) const;

  /// Returns a nested mapping; empty if it is absent. `in_table`: its key in the table, if different.
  Fields section(const std::string& key) const { return section(key, key); }
  Fields section(const std::string& key, const std::string& in_table) const;
  /// Returns a list of mappings; empty if it is absent.
  std::vector<Fields> sections(const std::string& key) const;
  /// Reads a mapping of names to sections, whose key in the table is NAME. Calls `read` for each of `names`
  /// that the mapping has.
  void named(const std::string& key, const std::vector<std::string>& names,
             const std::function<void(const Fields&, std::size_t)>& read) const;

  /// Throws the file's ConfigError if `holds` is false. `problem` gives the fault and what is allowed.
  void check(bool holds, const std::string& key, const std::string& problem) const {
    if (!holds) throw error(key, problem);
  }
  /// Refuses keys that nothing has read, here and in every section opened from here.
  void finish() const;
  /// Returns a ConfigError for `key` with file and line: "cell.yaml:12: objects[3].mesh: 'x.stl' <problem>".
  ConfigError error(const std::string& key, const std::string& problem) const;
  /// Returns the place of this mapping: "cell.yaml:12: objects[3]".
  std::string place() const;
  std::filesystem::path file() const;

 private:
  struct Node;
  Fields(std::shared_ptr<Node> node, FieldTable table, std::string place)
      : node_(std::move(node)), table_(std::move(table)), place_(std::move(place)) {}
  /// Returns the table's entry for the key; null if the key is absent. Refuses the file if it is required.
  const FieldSpec* asked(const std::string& key, const std::string& kind) const;
  std::optional<double> number_of(const std::string& key, bool whole) const;
  std::optional<std::string> text_of(const std::string& key) const;
  std::optional<std::size_t> chosen_of(const std::string& key, const std::vector<std::string>& names) const;
  std::optional<Eigen::Vector3d> vector3_of(const std::string& key) const;
  template <class T>
  void list(const std::string& key, std::vector<T>& values) const;

  std::shared_ptr<Node> node_;
  FieldTable table_;
  std::string place_;  // in the table: "window." or empty at the root
};

}  // namespace phantom::runtime
