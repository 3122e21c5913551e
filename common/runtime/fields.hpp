#pragma once

#include <cmath>
#include <concepts>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

/// Allowed values of a field, from a table of parameters.
struct FieldSpec {
  bool required = false;
  std::string unit;
  double min = Range().min, max = Range().max;
  std::vector<std::string> names;  ///< allowed names of a choice

  Range range() const { return {min, max, unit.c_str()}; }
};

/// Table of a component's parameters, read from the shipped YAML file. The comment after a key gives in
/// brackets what is allowed, then what the key means:
///
///     measure_s: 5       # [0.1 to 600 s] how long hz and latency listen
///     mode: continuous   # [continuous, on_event]
///     # hand:            # may be left out, and is
///     #   node: 1        # [required: 1 to 127]
///
/// "; left out: 3" at the end of the brackets is for people: the value that applies without the key, if not
/// the value shown. Keys are dotted: hand.node; drives[].node of each item of a list; joints.NAME.k_p of any
/// name.
class FieldTable {
 public:
  /// Reads the table from one or more texts, one after the other.
  FieldTable(std::initializer_list<const char*> yaml);
  /// Returns the field's specification. Throws std::logic_error if the table has no such key.
  const FieldSpec& at(const std::string& key) const;

 private:
  std::map<std::string, FieldSpec> specs_;
};

/// Reads a configuration file, or a section of it, by a table of parameters. Each call names the key and the
/// member that receives its value. The table decides what is allowed. An absent key leaves the member
/// unchanged. Every fault of the file is a ConfigError; a key that is not in the table is a std::logic_error.
///
///     Fields file(path, {kParameters});
///     file.number("measure_s", config.measure_s);
///     file.section("page").flag("enabled", config.page.enabled);
///     file.finish();
class Fields : public ConfigReader {
 public:
  Fields(const std::filesystem::path& file, const FieldTable& table)
      : ConfigReader(from_file(file)), table_(std::make_shared<FieldTable>(table)) {}

  /// Reads a number. `scale` converts the key's unit to the member's, e.g. 1e-3 for a key in mm and a member
  /// in m. An integral member accepts whole numbers only, unless it is scaled.
  template <class T>
  void number(const char* key, T& value, double scale = 1.0) const {
    const FieldSpec* spec = asked(key);
    if (spec == nullptr) return;
    if constexpr (std::integral<T>) {
      value = scale == 1.0 ? static_cast<T>(integer(key, spec->range()))
                           : static_cast<T>(std::llround(ConfigReader::number(key, spec->range()) * scale));
    } else {
      value = ConfigReader::number(key, spec->range()) * scale;
    }
  }
  /// Returns the number, or `fallback` if the key is absent.
  double value(const char* key, double fallback = 0.0) const {
    number(key, fallback);
    return fallback;
  }
  void flag(const char* key, bool& value) const {
    if (asked(key) != nullptr) value = ConfigReader::flag(key, value);
  }
  /// Reads a text, or a path that is not made relative to the file's folder.
  template <class T>
  void text(const char* key, T& value) const {
    if (asked(key) != nullptr) value = ConfigReader::text(key);
  }
  /// Reads one of the names in `all`, which must be those of the table, and assigns the value paired with it.
  template <class T>
  void choice(const char* key, T& value,
              const std::vector<std::pair<const char*, std::type_identity_t<T>>>& all) const {
    std::vector<const char*> names;
    for (const auto& one : all) names.push_back(one.first);
    if (const auto chosen = chosen_of(key, names)) value = all[*chosen].second;
  }
  void numbers(const char* key, std::vector<double>& values) const {
    if (const FieldSpec* spec = asked(key)) values = ConfigReader::numbers(key, spec->range());
  }
  /// [x, y, z]
  template <class T>
  void vector3(const char* key, T& value) const {
    if (asked(key) == nullptr) return;
    const Eigen::Vector3d read = ConfigReader::vector3(key);
    value = {read.x(), read.y(), read.z()};
  }

  /// Returns a nested mapping; empty if it is absent. `in_table`: its key in the table, if different.
  Fields section(const std::string& key) const { return section(key, key); }
  Fields section(const std::string& key, const std::string& in_table) const {
    return {optional_section(key), *this, in_table};
  }
  /// Returns a list of mappings.
  std::vector<Fields> sections(const std::string& key) const;
  /// Reads a mapping of names to sections, whose key in the table is NAME. Calls `read` for each of `names`
  /// that the mapping has.
  void named(const char* key, const std::vector<std::string>& names,
             const std::function<void(const Fields&, std::size_t)>& read) const;

  /// Throws the file's ConfigError if `holds` is false. `problem` gives the fault and what is allowed.
  void check(bool holds, const std::string& key, const std::string& problem) const {
    if (!holds) throw error(key, problem);
  }

 private:
  Fields(ConfigReader reader, const Fields& parent, const std::string& key)
      : ConfigReader(std::move(reader)), table_(parent.table_), place_(parent.place_ + key + ".") {}
  /// Returns the table's entry for the key; null if the key is absent and not required.
  const FieldSpec* asked(const std::string& key) const;
  std::optional<std::size_t> chosen_of(const char* key, const std::vector<const char*>& names) const;

  std::shared_ptr<const FieldTable> table_;
  std::string place_;  // "window." or empty at the root
};

}  // namespace phantom::runtime
