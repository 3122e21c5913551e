#include "components/synthetic_viewer/state/localized_text.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <type_traits>

namespace phantom::synthetic_viewer {

namespace assets {
extern const char *const kEnglishTexts, *const kGermanTexts;
}  // namespace assets

std::string in(Language language, const LocalizedText& words) {
  using Texts = std::map<std::string, std::string>;
  static const Texts english = nlohmann::json::parse(assets::kEnglishTexts).get<Texts>(),
                     german = nlohmann::json::parse(assets::kGermanTexts).get<Texts>();
  const Texts& texts = language == Language::kGerman ? german : english;
  if (words.empty()) return {};
  const auto found = texts.find(words.key);
  if (found == texts.end()) return words.key;
  fmt::dynamic_format_arg_store<fmt::format_context> values;
  for (const LocalizedText::Value& value : words.values) {
    if (const auto* number = std::get_if<double>(&value.content)) {
      values.push_back(fmt::arg(value.name.c_str(), *number));
    } else if (const auto* text = std::get_if<std::string>(&value.content)) {
      values.push_back(fmt::arg(value.name.c_str(), *text));
    } else {
      values.push_back(fmt::arg(value.name.c_str(), in(language, std::get<LocalizedText>(value.content))));
    }
  }
  return fmt::vformat(found->second, values);
}

nlohmann::json json_of(const LocalizedText& words) {
  if (words.empty()) return {};
  nlohmann::json values = nlohmann::json::object();
  for (const LocalizedText::Value& value : words.values) {
    values[value.name] = std::visit(
        [](const auto& content) {
          if constexpr (std::is_same_v<std::decay_t<decltype(content)>, LocalizedText>)
            return json_of(content);
          else
            return nlohmann::json(content);
        },
        value.content);
  }
  return {{"key", words.key}, {"values", values}};
}

nlohmann::json json_of(const std::vector<LocalizedText>& list) {
  nlohmann::json json = nlohmann::json::array();
  for (const LocalizedText& words : list) json.push_back(json_of(words));
  return json;
}

}  // namespace phantom::synthetic_viewer
