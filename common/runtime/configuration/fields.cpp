#include "common/runtime/configuration/fields.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <numeric>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/core/text.hpp"
#include "common/core/units.hpp"
#include "common/core/utf8.hpp"

namespace phantom::runtime {
namespace {

/// Parses the text in the brackets.
FieldSpec spec_of(std::string allowed) {
  FieldSpec spec;
  spec.required = allowed.starts_with("required");
  allowed = std::regex_replace(allowed, std::regex("^required(: )?|^or: |(; |^)left out: .*$"), "");
  std::smatch match;
  if (std::regex_match(allowed, match, std::regex("(-?[0-9.]+\\S*) to (\\S+) ?(.*)"))) {
    spec.min = std::stod(match[1]);
    spec.max = std::stod(match[2]);
    spec.unit = match[3];
    return spec;
  }
  const std::regex name("[^, ]+");
  for (std::sregex_iterator at(allowed.begin(), allowed.end(), name), end; at != end; ++at)
    spec.names.push_back(at->str());
  return spec;
}

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

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream stream(path);
  if (!stream)
    throw core::MissingError(path.string() + ": cannot be read; check that the file exists and may be read");
  if (std::filesystem::is_directory(path))
    throw ConfigError(path.string() + ": is a folder; allowed: a file");
  constexpr std::size_t kMax = 64 << 20, kBlock = 1 << 16;  // a longer file must be a device
  std::string text;
  for (std::string block(kBlock, '\0'); stream;
       text.append(block, 0, static_cast<std::size_t>(stream.gcount()))) {
    if (text.size() > kMax)
      throw ConfigError(path.string() + ": has more than 64 MiB; allowed: at most that");
    stream.read(block.data(), static_cast<std::streamsize>(kBlock));
  }
  return text;
}

std::string show(const YAML::Node& value) {
  if (value.IsScalar()) return "'" + value.Scalar() + "'";
  return value.IsMap() ? "a mapping" : value.IsSequence() ? "a list" : "nothing";
}

// Every value takes a byte of text at least; only aliases make more of it.
constexpr std::size_t kNodesPerByte = 2, kNodesMore = 1024;
constexpr int kMaxDepth = 128;

/// Counts the values in `node` into `left`, each as often as aliases repeat it. Returns false once there are
/// more, or lie deeper (an alias within what it names lies endlessly deep).
bool count_expanded(const YAML::Node& node, std::size_t& left, int depth = 0) {
  if (left == 0 || depth > kMaxDepth) return false;
  --left;
  if (node.IsSequence()) {
    return std::all_of(node.begin(), node.end(),
                       [&](const auto& item) { return count_expanded(item, left, depth + 1); });
  }
  return !node.IsMap() || std::all_of(node.begin(), node.end(), [&](const auto& item) {
    return count_expanded(item.first, left, depth + 1) && count_expanded(item.second, left, depth + 1);
  });
}

void check_expanded(const YAML::Node& node, std::size_t most, const std::string& name) {
  std::size_t left = most;
  if (!count_expanded(node, left))
    throw ConfigError(name + ": with its aliases (*name) it has more than " + std::to_string(most) +
                      " values, or more than " + std::to_string(kMaxDepth) +
                      " levels; allowed: at most that");
}

double checked_number(const Fields& fields, const std::string& key, const YAML::Node& value,
                      const FieldSpec& spec, bool whole) {
  double number = 0.0;
  const char* fault = nullptr;
  if (!value.IsScalar() || !YAML::convert<double>::decode(value, number)) {
    fault = "is not a number";
  } else if (!std::isfinite(number) || number < spec.min || number > spec.max) {
    fault = "is out of range";
  } else if (whole && (number != std::floor(number) || std::abs(number) > 2e9)) {
    fault = "is not a whole number";
  }
  if (fault != nullptr) throw fields.error(key, std::string(fault) + "; allowed: " + spec.range());
  return number;
}

}  // namespace

std::string FieldSpec::range() const {
  if (std::isinf(max)) return "a finite number";
  std::ostringstream out;
  out << min << " to " << max << (unit.empty() ? "" : " ") << unit;
  return out.str();
}

FieldTable::FieldTable(std::initializer_list<const char*> yaml) {
  // Groups: indent, "# " of a commented-out key, indent, dash of a list item, key, brackets in the comment.
  const std::regex key_line("^( *)(# )?( *)(- )?(\\w+):(?: [^#]*)?(?:# (?:\\[([^\\]]*)\\])?.*)?$");
  std::map<std::string, FieldSpec> specs;
  std::vector<std::pair<std::size_t, std::string>>
      sections;  // open sections of the line: indent, and "key." or "key[]."
  const auto leave = [&](std::size_t indent) {
    while (!sections.empty() && sections.back().first >= indent) sections.pop_back();
    return sections.empty() ? std::string() : sections.back().second;
  };
  for (const char* text : yaml) {
    std::istringstream lines(text);
    std::smatch match;
    for (std::string line; std::getline(lines, line);) {
      if (!std::regex_match(line, match, key_line)) continue;
      std::size_t indent = static_cast<std::size_t>(match.length(1) + match.length(3));
      if (match[4].matched) {
        const std::string list = leave(indent);
        sections.emplace_back(indent, list.substr(0, list.size() - 1) + "[].");
        indent += 2;
      }
      const std::string key = leave(indent) + match.str(5);
      specs.emplace(key, spec_of(match[6]));
      sections.emplace_back(indent, key + ".");
    }
  }
  specs_ = std::make_shared<const std::map<std::string, FieldSpec>>(std::move(specs));
}

const FieldSpec& FieldTable::at(const std::string& key) const {
  const auto found = specs_->find(key);
  if (found == specs_->end()) throw std::logic_error("the table of keys has no " + key);
  return found->second;
}

struct Fields::Node {
  YAML::Node yaml;
  std::filesystem::path file;
  std::string place;  // "objects[3]." or empty at the root
  int line = 1;
  std::set<std::string> asked;
  std::vector<std::shared_ptr<Node>> children;

  std::shared_ptr<Node> child(const YAML::Node& sub, const std::string& name) {
    const int at = sub.Mark().line >= 0 ? sub.Mark().line + 1 : line;
    return children.emplace_back(std::make_shared<Node>(Node{sub, file, place + name + ".", at, {}, {}}));
  }
  YAML::Node find(const std::string& key) {
    asked.insert(key);
    return static_cast<const YAML::Node&>(yaml)[key];
  }
};

Fields::Fields(const std::filesystem::path& file, const FieldTable& table)
    : Fields(from_text(text_of_file(file), file.string(), table)) {}

Fields Fields::from_text(const std::string& yaml, const std::string& name, const FieldTable& table) {
  if (const std::size_t good = core::utf8_prefix(yaml); good < yaml.size()) {
    const auto line = 1 + std::count(yaml.begin(), yaml.begin() + static_cast<std::ptrdiff_t>(good), '\n');
    throw ConfigError(name + ":" + std::to_string(line) + ": holds a byte that is no text; allowed: UTF-8");
  }
  auto node = std::make_shared<Node>();
  node->file = name;
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(yaml);
    if (documents.size() > 1) {
      throw ConfigError(name + ":" + std::to_string(documents[1].Mark().line + 1) +
                        ": a second YAML document begins here (after '---'); allowed: one in a file");
    }
    if (!documents.empty()) node->yaml = documents.front();
  } catch (const YAML::Exception& problem) {
    throw ConfigError(name + ":" + std::to_string(problem.mark.line + 1) +
                      ": not valid YAML: " + problem.msg);
  }
  check_expanded(node->yaml, kNodesPerByte * yaml.size() + kNodesMore, name);
  if (node->yaml.IsNull()) node->yaml = YAML::Node(YAML::NodeType::Map);
  if (!node->yaml.IsMap()) throw ConfigError(name + ":1: the file must be a mapping of keys to values");
  return {std::move(node), table, ""};
}

bool Fields::has(const std::string& key) const {
  const YAML::Node value = node_->find(key);
  return value.IsDefined() && !value.IsNull();
}

const FieldSpec* Fields::asked(const std::string& key, const std::string& kind) const {
  const FieldSpec& spec = table_.at(place_ + key);
  if (has(key)) return &spec;
  check(!spec.required, key, "is missing; allowed: " + (kind.empty() ? spec.range() : kind));
  return nullptr;
}

std::optional<double> Fields::number_of(const std::string& key, bool whole) const {
  const FieldSpec* spec = asked(key, "");
  if (spec == nullptr) return std::nullopt;
  return checked_number(*this, key, node_->find(key), *spec, whole);
}

void Fields::flag(const std::string& key, bool& value) const {
  if (asked(key, "true or false") == nullptr) return;
  const YAML::Node node = node_->find(key);
  check(node.IsScalar() && YAML::convert<bool>::decode(node, value), key, "is not true or false");
}

std::optional<std::string> Fields::text_of(const std::string& key) const {
  const FieldSpec* spec = asked(key, "a text");
  if (spec == nullptr) return std::nullopt;
  const YAML::Node node = node_->find(key);
  check(node.IsScalar(), key, "is " + show(node) + "; allowed: a text");
  const auto bytes = static_cast<double>(node.Scalar().size());
  check(spec->unit != "bytes" || (bytes >= spec->min && bytes <= spec->max), key,
        "has " + std::to_string(node.Scalar().size()) + " bytes; allowed: " + spec->range());
  return node.Scalar();
}

std::optional<std::size_t> Fields::chosen_of(const std::string& key,
                                             const std::vector<std::string>& names) const {
  if (table_.at(place_ + key).names != names)
    throw std::logic_error("the table of keys has other names for " + place_ + key);
  const auto name = text_of(key);
  if (!name) return std::nullopt;
  const auto found = std::ranges::find(names, *name);
  check(found != names.end(), key, "is not known; allowed: " + core::listed(names));
  return found - names.begin();
}

std::string Fields::one_of(const std::string& key, const std::string& noun) const {
  std::vector<std::string> all = table_.at(place_ + key).names;
  all.insert(all.begin(), key);
  std::string found;
  for (const std::string& one : all) {
    if (!has(one)) continue;
    check(found.empty(), one, "stands beside " + found + "; allowed: one of " + core::listed(all));
    found = one;
  }
  if (found.empty() && !noun.empty())
    throw ConfigError(place() + ": names no " + noun + "; allowed: one of " + core::listed(all));
  return found;
}

template <class T>
void Fields::list(const std::string& key, std::vector<T>& values) const {
  const bool texts = std::is_same_v<T, std::string>, whole = std::integral<T>;
  const std::string kind = std::string("a list of ") + (texts   ? "texts"
                                                        : whole ? "whole numbers"
                                                                : "numbers");
  const FieldSpec* spec = asked(key, kind);
  if (spec == nullptr) return;
  const YAML::Node node = node_->find(key);
  check(node.IsSequence(), key, "is not a list; allowed: " + kind);
  values.clear();
  for (const auto& item : node) {
    if constexpr (std::is_same_v<T, std::string>) {
      check(item.IsScalar(), key, "holds something that is not a text");
      values.push_back(item.Scalar());
    } else {
      values.push_back(static_cast<T>(checked_number(*this, key, item, *spec, whole)));
    }
  }
}
void Fields::numbers(const std::string& key, std::vector<double>& values) const { list(key, values); }
void Fields::numbers(const std::string& key, std::vector<int>& values) const { list(key, values); }
void Fields::numbers(const std::string& key, std::map<std::string, double>& values) const {
  const FieldSpec* spec = asked(key, "a mapping of names to numbers");
  if (spec == nullptr) return;
  const Fields all = section(key);
  values.clear();
  for (const auto& item : all.node_->yaml) {
    check(item.first.IsScalar(), key, "holds a name that is not a text");
    const std::string& name = item.first.Scalar();
    values[name] = checked_number(all, name, all.node_->find(name), *spec, false);
  }
}
void Fields::texts(const std::string& key, std::vector<std::string>& values) const { list(key, values); }

std::optional<Eigen::Vector3d> Fields::vector3_of(const std::string& key) const {
  std::vector<double> values;
  list(key, values);
  if (!has(key)) return std::nullopt;
  check(values.size() == 3, key,
        "has " + std::to_string(values.size()) + " numbers; allowed: three, [x, y, z]");
  return Eigen::Vector3d(values[0], values[1], values[2]);
}

void Fields::axes(const std::string& key, Eigen::Vector3d& value) const {
  const FieldSpec* spec = asked(key, "");
  if (spec == nullptr) return;
  const YAML::Node node = node_->find(key);
  if (!node.IsSequence()) {
    value.setConstant(checked_number(*this, key, node, *spec, false));
    return;
  }
  check(node.size() == 3, key,
        "has " + std::to_string(node.size()) + " numbers; allowed: one, or three, [x, y, z]");
  value = *vector3_of(key);
}

geometry::Pose Fields::pose(const std::string& key) const {
  static const FieldTable keys{"xyz_m: [0, 0, 0]\nrpy_deg: [0, 0, 0]"};
  const Fields part(section(key).node_, keys, "");
  const Eigen::Vector3d rpy_rad = part.vector3("rpy_deg") * core::kRadPerDegree;
  return {geometry::rotation_from_rpy(rpy_rad.x(), rpy_rad.y(), rpy_rad.z()), part.vector3("xyz_m")};
}

std::filesystem::path Fields::path(const std::string& key) const {
  const auto given = text_of(key);
  return given ? node_->file.parent_path() / *given : std::filesystem::path();
}

std::filesystem::path Fields::existing_file(const std::string& key) const {
  std::filesystem::path found = path(key);
  check(!std::filesystem::is_directory(found), key, "is a folder (" + found.string() + "); allowed: a file");
  if (!found.empty() && !std::filesystem::exists(found))
    throw core::MissingError(error(key, "is not there (" + found.string() + ")").what());
  return found;
}

Fields Fields::section(const std::string& key, const std::string& in_table) const {
  table_.at(place_ + in_table);
  const bool given = in_table != key ? has(key) : asked(key, "a mapping") != nullptr;
  // Not assigned later: yaml-cpp would copy its list of all nodes of the document each time.
  const YAML::Node node = given ? node_->find(key) : YAML::Node(YAML::NodeType::Map);
  check(node.IsMap(), key, "is " + show(node) + "; allowed: a mapping");
  return {node_->child(node, key), table_, place_ + in_table + "."};
}

std::vector<Fields> Fields::sections(const std::string& key) const {
  std::vector<Fields> items;
  if (asked(key, "a list of mappings") == nullptr) return items;
  const YAML::Node node = node_->find(key);
  check(node.IsSequence(), key, "is " + show(node) + "; allowed: a list of mappings");
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string name = key + "[" + std::to_string(i) + "]";
    check(node[i].IsMap(), key, "holds " + show(node[i]) + " at " + name + "; allowed: mappings");
    items.push_back({node_->child(node[i], name), table_, place_ + key + "[]."});
  }
  return items;
}

void Fields::named(const std::string& key, const std::vector<std::string>& names,
                   const std::function<void(const Fields&, std::size_t)>& read) const {
  const Fields all = section(key);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (all.has(names[i])) read(all.section(names[i], "NAME"), i);
  }
}

void Fields::finish() const {
  std::set<std::string> seen;
  for (const auto& item : node_->yaml) {
    const auto key = item.first.as<std::string>();
    check(seen.insert(key).second, key, "stands twice");
    if (node_->asked.contains(key)) continue;
    const std::vector<std::string> known(node_->asked.begin(), node_->asked.end());
    const auto distance = [&](const std::string& name) { return edit_distance(name, key); };
    const auto nearest = std::ranges::min_element(known, {}, distance);
    const bool near = nearest != known.end() && distance(*nearest) <= 3;
    throw ConfigError(node_->file.string() + ":" + std::to_string(item.first.Mark().line + 1) + ": " +
                      node_->place + key + ": unknown key" +
                      (near ? " (did you mean " + *nearest + "?)" : "") +
                      "; allowed: " + core::listed(known));
  }
  for (const auto& child : node_->children) Fields(child, table_, "").finish();
}

ConfigError Fields::error(const std::string& key, const std::string& problem) const {
  const YAML::Node value = node_->find(key);
  const int line = value.IsDefined() && value.Mark().line >= 0 ? value.Mark().line + 1 : node_->line;
  std::string message = node_->file.string() + ":" + std::to_string(line) + ": " + node_->place + key + ": ";
  if (value.IsDefined() && value.IsScalar()) message += show(value) + " ";
  return ConfigError(message + problem);
}

std::string Fields::place() const {
  const std::string& dotted = node_->place;
  const std::string name = dotted.empty() ? "" : ": " + dotted.substr(0, dotted.size() - 1);
  return node_->file.string() + ":" + std::to_string(node_->line) + name;
}

std::filesystem::path Fields::file() const { return node_->file; }

}  // namespace phantom::runtime
