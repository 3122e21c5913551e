#include "common/runtime/fields.hpp"

#include <algorithm>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace phantom::runtime {
namespace {

/// Parses the text in the brackets.
FieldSpec spec_of(std::string allowed) {
  FieldSpec spec;
  spec.required = allowed.starts_with("required");
  allowed = std::regex_replace(allowed, std::regex("^required(: )?|(; |^)left out: .*$"), "");
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

}  // namespace

FieldTable::FieldTable(std::initializer_list<const char*> yaml) {
  // Groups: indent, "# " of a commented-out key, indent, dash of a list item, key, brackets in the comment.
  const std::regex key_line("^( *)(# )?( *)(- )?(\\w+):(?: [^#]*)?(?:# (?:\\[([^\\]]*)\\])?.*)?$");
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
      specs_.emplace(key, spec_of(match[6]));
      sections.emplace_back(indent, key + ".");
    }
  }
}

const FieldSpec& FieldTable::at(const std::string& key) const {
  const auto found = specs_.find(key);
  if (found == specs_.end()) throw std::logic_error("the table of parameters has no " + key);
  return found->second;
}

const FieldSpec* Fields::asked(const std::string& key) const {
  const FieldSpec& spec = table_->at(place_ + key);
  return has(key) || spec.required ? &spec : nullptr;
}

std::optional<std::size_t> Fields::chosen_of(const char* key, const std::vector<const char*>& names) const {
  if (!std::ranges::equal(table_->at(place_ + key).names, names))
    throw std::logic_error("the table of parameters has other names for " + place_ + key);
  if (asked(key) == nullptr) return std::nullopt;
  const std::string name = ConfigReader::choice(key, "", names);
  return std::ranges::find(names, name) - names.begin();
}

std::vector<Fields> Fields::sections(const std::string& key) const {
  std::vector<Fields> items;
  for (const ConfigReader& item : ConfigReader::sections(key)) items.push_back({item, *this, key + "[]"});
  return items;
}

void Fields::named(const char* key, const std::vector<std::string>& names,
                   const std::function<void(const Fields&, std::size_t)>& read) const {
  const Fields all = section(key);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (all.has(names[i])) read(all.section(names[i], "NAME"), i);
  }
}

}  // namespace phantom::runtime
