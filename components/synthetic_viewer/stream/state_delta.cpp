#include "components/synthetic_viewer/stream/state_delta.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace phantom::synthetic_viewer {
namespace {

std::string text_of_piece(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void StateDelta::put(Entries& entries, const std::string& name, std::string text, bool gone) {
  Piece& piece = entries[name];
  if (piece.number != 0 && piece.text == text && piece.gone == gone) return;
  piece = {std::move(text), ++number_, gone};
}

void StateDelta::put(const nlohmann::json& state) {
  for (const auto& [key, value] : state.items()) {
    Entries& entries = pieces_[key];
    const bool by_entry = !entries.empty() && !entries.contains("");
    const bool whole = !value.is_object() || (value.empty() && !by_entry);
    if (whole == by_entry) entries.clear();  // it was of the other sort
    if (whole) {
      put(entries, "", text_of_piece(value));
      continue;
    }
    for (const auto& [name, entry] : value.items()) put(entries, name, text_of_piece(entry));
    for (const auto& [name, piece] : entries)
      if (!value.contains(name)) put(entries, name, "null", true);
  }
}

std::string StateDelta::since(std::uint64_t& seen) const {
  if (seen == number_) return {};
  std::string message = R"({"type":"state")";
  for (const auto& [key, entries] : pieces_) {
    std::string told;
    for (const auto& [name, piece] : entries) {
      if (piece.number <= seen) continue;
      if (!told.empty()) told += ',';
      told += name.empty() ? piece.text : fmt::format("{}:{}", text_of_piece(name), piece.text);
    }
    if (told.empty()) continue;
    if (!entries.contains("")) told = fmt::format("{{{}}}", told);
    message += fmt::format(",{}:{}", text_of_piece(key), told);
  }
  seen = number_;
  return message + "}";
}

void StateDelta::forget(std::uint64_t seen) {
  for (auto& [key, entries] : pieces_)
    std::erase_if(entries,
                  [seen](const auto& known) { return known.second.gone && known.second.number <= seen; });
}

}  // namespace phantom::synthetic_viewer
