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

/// What a table of parameters allows a field to be.
struct FieldSpec {
  bool required = false;
  std::string unit;
  double min = Range().min, max = Range().max;
  std::vector<std::string> names;  ///< of a choice

  Range range() const { return {min, max, unit.c_str()}; }
};

/// A component's parameters: the shipped YAML file. The comment behind a key says in brackets what is
/// allowed, and then what the key means:
///
///     measure_s: 5       # [0.1 to 600 s] how long hz and latency listen
///     mode: continuous   # [continuous, on_event]
///     # hand:            # may be left out, and is
///     #   node: 1        # [required: 1 to 127]
///
/// "; left out: 3" at the brackets' end is for people: what holds without the key, if not the value shown.
/// Keys are dotted: hand.node; drives[].node of each item of a list; joints.NAME.k_p of any name.
class FieldTable {
 public:
  /// Of one text or several behind each other.
  FieldTable(std::initializer_list<const char*> yaml);
  /// Throws std::logic_error if the table has no such key.
  const FieldSpec& at(const std::string& key) const;

 private:
  std::map<std::string, FieldSpec> specs_;
};

/// A configuration file, or a section of it, that is read by a table of parameters: each call says for which
/// member a key stands. What is allowed is the table's; a key that is left out leaves the member as it is.
/// Every fault of the file is a ConfigError; a key that the table does not have is a std::logic_error.
///
///     Fields file(path, {kParameters});
///     file.number("measure_s", config.measure_s);
///     file.section("page").flag("enabled", config.page.enabled);
///     file.finish();
class Fields : public ConfigReader {
 public:
  Fields(const std::filesystem::path& file, const FieldTable& table)
      : ConfigReader(from_file(file)), table_(std::make_shared<FieldTable>(table)) {}

  /// `scale`: one of the key's unit in the member's, e.g. 1e-3 for a key in mm and a member in m. A member
  /// that is a whole number takes whole numbers only, unless it is scaled.
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
  /// The same as a value of its own.
  double value(const char* key, double fallback = 0.0) const {
    number(key, fallback);
    return fallback;
  }
  void flag(const char* key, bool& value) const {
    if (asked(key) != nullptr) value = ConfigReader::flag(key, value);
  }
  /// A text; also a path that is taken as it stands.
  template <class T>
  void text(const char* key, T& value) const {
    if (asked(key) != nullptr) value = ConfigReader::text(key);
  }
  /// One of the names, which are the table's, too; what stands beside it becomes the value.
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

  /// A nested mapping; empty if it is left out. `in_table`: its key there, if that is another.
  Fields section(const std::string& key) const { return section(key, key); }
  Fields section(const std::string& key, const std::string& in_table) const {
    return {optional_section(key), *this, in_table};
  }
  /// A list of mappings.
  std::vector<Fields> sections(const std::string& key) const;
  /// A mapping of names to sections, which are NAME in the table: calls `read` for each of `names` that it
  /// has.
  void named(const char* key, const std::vector<std::string>& names,
             const std::function<void(const Fields&, std::size_t)>& read) const;

  /// Refuses the file if a rule does not hold; `problem` says what the key's value is and what is allowed.
  void check(bool holds, const std::string& key, const std::string& problem) const {
    if (!holds) throw error(key, problem);
  }

 private:
  Fields(ConfigReader reader, const Fields& parent, const std::string& key)
      : ConfigReader(std::move(reader)), table_(parent.table_), place_(parent.place_ + key + ".") {}
  /// What the table says of the key, if it is to be read.
  const FieldSpec* asked(const std::string& key) const;
  std::optional<std::size_t> chosen_of(const char* key, const std::vector<const char*>& names) const;

  std::shared_ptr<const FieldTable> table_;
  std::string place_;  // "window." or empty at the root
};

}  // namespace phantom::runtime
