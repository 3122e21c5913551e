#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <variant>
#include <vector>

namespace phantom::synthetic_viewer {

/// A language of which web/texts.*.json has the texts.
enum class Language { kEnglish, kGerman };

/// A sentence for the operator: its key in web/texts.*.json, and what is filled in there. The page shows it
/// in the language that its reader has chosen, pictures and window in that of the configuration, the log
/// english_text(). A plain value.
struct LocalizedText {
  struct Value;
  std::string key;  ///< empty: nothing to say
  std::vector<Value> values;

  bool empty() const { return key.empty(); }
  friend bool operator==(const LocalizedText& a, const LocalizedText& b);
};

/// What is filled into a sentence under `name`.
struct LocalizedText::Value {
  std::string name;
  /// A number, rounded as the text asks for; a name or a message, as it is; another sentence.
  std::variant<double, std::string, LocalizedText> content;

  friend bool operator==(const Value&, const Value&) = default;
};

inline bool operator==(const LocalizedText& a, const LocalizedText& b) {
  return a.key == b.key && a.values == b.values;
}

/// Returns the sentence as the file of that language has it; empty if there is nothing to say, the key where
/// that file lacks it. Thread-safe; not real-time safe.
std::string in(Language language, const LocalizedText& words);
/// Returns the sentence as the page takes it, {"key": …, "values": {…}}; null if there is nothing to say.
nlohmann::json json_of(const LocalizedText& words);
nlohmann::json json_of(const std::vector<LocalizedText>& list);
inline std::string english_text(const LocalizedText& words) { return in(Language::kEnglish, words); }

}  // namespace phantom::synthetic_viewer
