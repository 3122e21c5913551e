#include "common/runtime/config_reader.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <set>

#include "common/core/units.hpp"
#include "common/core/utf8.hpp"

namespace phantom::runtime {

struct ConfigReader::Node {
  YAML::Node yaml;
  std::filesystem::path file;
  std::string place;  // "objects[3]." or empty at the root
  int line = 0;
  std::set<std::string> asked;
  std::vector<std::shared_ptr<Node>> children;

  std::shared_ptr<Node> child(const YAML::Node& sub, const std::string& name) {
    auto node = std::make_shared<Node>();
    node->yaml = sub;
    node->file = file;
    node->place = place + name + ".";
    node->line = sub.Mark().line >= 0 ? sub.Mark().line + 1 : line;
    children.push_back(node);
    return node;
  }
  YAML::Node find(const std::string& key) {
    asked.insert(key);
    if (!yaml.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
    return static_cast<const YAML::Node&>(yaml)[key];
  }
  static std::string show(const YAML::Node& value) {
    if (value.IsScalar()) return "'" + value.Scalar() + "'";
    return value.IsMap() ? "a mapping" : value.IsSequence() ? "a list" : "nothing";
  }
};

namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t keep = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({keep, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

std::string allowed_range(Range range) {
  std::ostringstream out;
  if (std::isinf(range.min) && std::isinf(range.max)) {
    out << "a finite number";
  } else if (std::isinf(range.max)) {
    out << "at least " << range.min;
  } else if (std::isinf(range.min)) {
    out << "at most " << range.max;
  } else {
    out << range.min << " to " << range.max;
  }
  if (*range.unit != '\0') out << ' ' << range.unit;
  return out.str();
}

double checked_number(const ConfigReader& reader, const std::string& key, const YAML::Node& value,
                      Range range) {
  double number = 0.0;
  if (!value.IsScalar() || !YAML::convert<double>::decode(value, number)) {
    throw reader.error(key, "is not a number; allowed: " + allowed_range(range));
  }
  if (!std::isfinite(number) || number < range.min || number > range.max) {
    throw reader.error(key, "is out of range; allowed: " + allowed_range(range));
  }
  return number;
}

int checked_integer(const ConfigReader& reader, const std::string& key, const YAML::Node& value,
                    Range range) {
  const double number = checked_number(reader, key, value, range);
  if (number != std::floor(number) || std::abs(number) > 2e9)
    throw reader.error(key, "is not a whole number");
  return static_cast<int>(number);
}

}  // namespace

ConfigReader ConfigReader::from_file(const std::filesystem::path& path) {
  std::ifstream stream(path);
  if (!stream)
    throw ConfigError(path.string() + ": cannot be read; check that the file exists and may be read");
  if (std::filesystem::is_directory(path))
    throw ConfigError(path.string() + ": is a folder; allowed: a file");
  constexpr std::size_t kMost = 64 << 20, kBlock = 1 << 16;  // a longer file must be a device
  std::string text;
  for (std::string block(kBlock, '\0'); stream;
       text.append(block, 0, static_cast<std::size_t>(stream.gcount()))) {
    if (text.size() > kMost)
      throw ConfigError(path.string() + ": has more than 64 MiB; allowed: at most that");
    stream.read(block.data(), static_cast<std::streamsize>(kBlock));
  }
  return from_text(text, path.string());
}

ConfigReader ConfigReader::from_text(const std::string& yaml, const std::string& name) {
  if (const std::size_t good = core::utf8_prefix(yaml); good < yaml.size()) {
    const auto line = 1 + std::count(yaml.begin(), yaml.begin() + static_cast<std::ptrdiff_t>(good), '\n');
    throw ConfigError(name + ":" + std::to_string(line) + ": holds a byte that is no text; allowed: UTF-8");
  }
  auto node = std::make_shared<Node>();
  node->file = name;
  node->line = 1;
  try {
    node->yaml = YAML::Load(yaml);
  } catch (const YAML::Exception& problem) {
    throw ConfigError(name + ":" + std::to_string(problem.mark.line + 1) +
                      ": not valid YAML: " + problem.msg);
  }
  if (node->yaml.IsNull()) node->yaml = YAML::Node(YAML::NodeType::Map);
  if (!node->yaml.IsMap()) throw ConfigError(name + ":1: the file must be a mapping of keys to values");
  return ConfigReader(node);
}

ConfigError ConfigReader::error(const std::string& key, const std::string& problem) const {
  const YAML::Node value = node_->find(key);
  const int line = value.IsDefined() && value.Mark().line >= 0 ? value.Mark().line + 1 : node_->line;
  std::string message = node_->file.string() + ":" + std::to_string(line) + ": " + node_->place + key + ": ";
  if (value.IsDefined() && value.IsScalar()) message += Node::show(value) + " ";
  return ConfigError(message + problem);
}

std::string ConfigReader::place() const {
  const std::string& dotted = node_->place;
  const std::string name = dotted.empty() ? "" : ": " + dotted.substr(0, dotted.size() - 1);
  return node_->file.string() + ":" + std::to_string(node_->line) + name;
}

std::filesystem::path ConfigReader::file() const { return node_->file; }

bool ConfigReader::has(const std::string& key) const {
  const YAML::Node value = node_->find(key);
  return value.IsDefined() && !value.IsNull();
}

double ConfigReader::number(const std::string& key, Range range) const {
  if (!has(key)) throw error(key, "is missing; allowed: " + allowed_range(range));
  return checked_number(*this, key, node_->find(key), range);
}

double ConfigReader::number(const std::string& key, double fallback, Range range) const {
  return has(key) ? number(key, range) : fallback;
}

int ConfigReader::integer(const std::string& key, Range range) const {
  if (!has(key)) throw error(key, "is missing; allowed: a whole number, " + allowed_range(range));
  return checked_integer(*this, key, node_->find(key), range);
}

int ConfigReader::integer(const std::string& key, int fallback, Range range) const {
  return has(key) ? integer(key, range) : fallback;
}

bool ConfigReader::flag(const std::string& key, bool fallback) const {
  if (!has(key)) return fallback;
  bool value = fallback;
  const YAML::Node node = node_->find(key);
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) throw error(key, "is not true or false");
  return value;
}

std::string ConfigReader::text(const std::string& key) const {
  if (!has(key)) throw error(key, "is missing; allowed: a text");
  const YAML::Node node = node_->find(key);
  if (!node.IsScalar()) throw error(key, "is " + Node::show(node) + "; allowed: a text");
  return node.Scalar();
}

std::string ConfigReader::text(const std::string& key, const std::string& fallback) const {
  return has(key) ? text(key) : fallback;
}

std::string ConfigReader::choice(const std::string& key, const std::string& fallback,
                                 const std::vector<const char*>& allowed) const {
  std::string value = text(key, fallback);
  std::string list;
  for (const char* candidate : allowed) {
    if (value == candidate) return value;
    list += (list.empty() ? "" : ", ") + std::string(candidate);
  }
  throw error(key, "is not known; allowed: " + list);
}

std::vector<double> ConfigReader::numbers(const std::string& key, Range range) const {
  const YAML::Node node = node_->find(key);
  if (!node.IsDefined()) throw error(key, "is missing; allowed: a list of numbers");
  if (!node.IsSequence()) throw error(key, "is not a list; allowed: a list of numbers");
  std::vector<double> values;
  for (const auto& item : node) values.push_back(checked_number(*this, key, item, range));
  return values;
}

std::vector<int> ConfigReader::integers(const std::string& key, Range range) const {
  const YAML::Node node = node_->find(key);
  if (!node.IsDefined()) throw error(key, "is missing; allowed: a list of whole numbers");
  if (!node.IsSequence()) throw error(key, "is not a list; allowed: a list of whole numbers");
  std::vector<int> values;
  for (const auto& item : node) values.push_back(checked_integer(*this, key, item, range));
  return values;
}

std::vector<std::string> ConfigReader::texts(const std::string& key) const {
  const YAML::Node node = node_->find(key);
  if (!node.IsDefined() || !node.IsSequence())
    throw error(key, "is missing or not a list; allowed: a list of texts");
  std::vector<std::string> values;
  for (const auto& item : node) {
    if (!item.IsScalar()) throw error(key, "holds something that is not a text");
    values.push_back(item.Scalar());
  }
  return values;
}

Eigen::Vector3d ConfigReader::vector3(const std::string& key) const {
  const std::vector<double> values = numbers(key);
  if (values.size() != 3) {
    throw error(key, "has " + std::to_string(values.size()) + " numbers; allowed: three, [x, y, z]");
  }
  return {values[0], values[1], values[2]};
}

Eigen::Vector3d ConfigReader::vector3(const std::string& key, const Eigen::Vector3d& fallback) const {
  return has(key) ? vector3(key) : fallback;
}

geometry::Pose ConfigReader::pose(const std::string& key) const {
  const ConfigReader part = optional_section(key);
  const Eigen::Vector3d rpy_rad = part.vector3("rpy_deg", Eigen::Vector3d::Zero()) * core::kRadPerDegree;
  return {geometry::rotation_from_rpy(rpy_rad.x(), rpy_rad.y(), rpy_rad.z()),
          part.vector3("xyz_m", Eigen::Vector3d::Zero())};
}

std::filesystem::path ConfigReader::path(const std::string& key) const {
  const std::filesystem::path given = text(key);
  return given.is_absolute() ? given : node_->file.parent_path() / given;
}

ConfigReader ConfigReader::section(const std::string& key) const {
  if (!has(key)) throw error(key, "is missing; allowed: a mapping");
  return optional_section(key);
}

ConfigReader ConfigReader::optional_section(const std::string& key) const {
  if (!has(key)) return ConfigReader(node_->child(YAML::Node(YAML::NodeType::Map), key));
  const YAML::Node node = node_->find(key);
  if (!node.IsMap()) throw error(key, "is " + Node::show(node) + "; allowed: a mapping");
  return ConfigReader(node_->child(node, key));
}

std::vector<ConfigReader> ConfigReader::sections(const std::string& key) const {
  std::vector<ConfigReader> items;
  if (!has(key)) return items;
  const YAML::Node node = node_->find(key);
  if (!node.IsSequence()) throw error(key, "is " + Node::show(node) + "; allowed: a list of mappings");
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string name = key + "[" + std::to_string(i) + "]";
    if (!node[i].IsMap())
      throw error(key, "holds " + Node::show(node[i]) + " at " + name + "; allowed: mappings");
    items.push_back(ConfigReader(node_->child(node[i], name)));
  }
  return items;
}

std::vector<std::string> ConfigReader::keys() const {
  std::vector<std::string> names;
  for (const auto& item : node_->yaml) names.push_back(item.first.as<std::string>());
  return names;
}

void ConfigReader::finish() const {
  std::set<std::string> seen;
  for (const auto& item : node_->yaml) {
    const auto key = item.first.as<std::string>();
    if (!seen.insert(key).second) throw error(key, "stands twice");
    if (node_->asked.contains(key)) continue;
    std::string list, nearest;
    for (const auto& known : node_->asked) {
      list += (list.empty() ? "" : ", ") + known;
      if (edit_distance(known, key) <= 3 &&
          (nearest.empty() || edit_distance(known, key) < edit_distance(nearest, key))) {
        nearest = known;
      }
    }
    const int line = item.first.Mark().line + 1;
    throw ConfigError(node_->file.string() + ":" + std::to_string(line) + ": " + node_->place + key +
                      ": unknown key" + (nearest.empty() ? "" : " (did you mean " + nearest + "?)") +
                      "; allowed: " + list);
  }
  for (const auto& child : node_->children) ConfigReader(child).finish();
}

}  // namespace phantom::runtime
