#include "common/diagnostics/text.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace phantom::diagnostics {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWidest = 130;  // greatest width of a value on one line, in columns
constexpr std::size_t kRun = 4;       // so many equal neighbours are counted instead of written

std::string scalar(const Json& value) {
  if (value.is_number_float()) return fmt::format("{:.9g}", value.get<double>());
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    return text.empty() ? "\"\"" : text.find('\n') == std::string::npos ? text : to_line(value);
  }
  return to_line(value);
}

bool all_scalars(const Json& value) {
  return std::all_of(value.begin(), value.end(), [](const Json& item) { return item.is_primitive(); });
}

std::string list_on_a_line(const Json& list) {
  std::string line = "[";
  for (std::size_t i = 0; i < list.size();) {
    std::size_t same = 1;
    while (i + same < list.size() && list[i + same] == list[i]) ++same;
    const std::size_t taken = same >= kRun ? same : 1;
    line += (i == 0 ? "" : ", ") + scalar(list[i]);
    if (taken > 1) line += " (×" + std::to_string(taken) + ")";
    i += taken;
  }
  return line + "]";
}

std::string struct_on_a_line(const Json& object) {
  std::string line = "{";
  for (const auto& [name, value] : object.items())
    line += (line.size() > 1 ? ", " : "") + name + ": " + scalar(value);
  return line + "}";
}

/// Returns the value on one line, or an empty string if it does not fit.
std::string on_a_line(const Json& value) {
  if (value.is_primitive()) return scalar(value);
  if (!all_scalars(value)) return "";
  if (value.is_array()) return list_on_a_line(value);
  const std::string line = struct_on_a_line(value);
  return line.size() <= kWidest ? line : "";
}

void append(const Json& value, std::size_t indent, std::string& text);

void append_member(const std::string& name, const Json& value, std::size_t indent, std::string& text) {
  const std::string line = on_a_line(value);
  text += std::string(indent, ' ') + name + (line.empty() ? ":" : ": " + line) + "\n";
  if (line.empty()) append(value, indent + 2, text);
}

void append_element(const Json& value, std::size_t indent, std::string& text) {
  const std::string line = on_a_line(value);
  const std::size_t begin = text.size();
  if (line.empty()) {
    append(value, indent + 2, text);
  } else {
    text += std::string(indent + 2, ' ') + line + "\n";
  }
  text[begin + indent] = '-';
}

void append(const Json& value, std::size_t indent, std::string& text) {
  if (value.is_primitive()) {
    text += std::string(indent, ' ') + scalar(value) + "\n";
  } else if (value.is_array()) {
    for (const Json& item : value) append_element(item, indent, text);
  } else {
    for (const auto& [name, item] : value.items()) append_member(name, item, indent, text);
  }
}

}  // namespace

std::string to_text(const Json& sample, std::size_t indent) {
  std::string text;
  append(sample, indent, text);
  return text;
}

std::string to_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace phantom::diagnostics
