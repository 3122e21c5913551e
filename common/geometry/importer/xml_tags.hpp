#pragma once

// Private to the importer: tags and attributes of XML, all that a model in it consists of.

#include <algorithm>
#include <optional>
#include <string_view>

#include "common/core/text.hpp"

namespace phantom::geometry::detail {

/// A tag of XML.
struct Tag {
  std::string_view name;  // without its prefix
  std::string_view attributes;
  bool opens = false, closes = false;  // <a/> does both

  /// Returns an attribute's value by its name without prefix; none if it is not there.
  std::optional<std::string_view> find(std::string_view wanted) const {
    std::string_view rest = attributes;
    for (std::size_t equals = rest.find('='); equals != std::string_view::npos; equals = rest.find('=')) {
      std::string_view key = core::trimmed(rest.substr(0, equals));
      if (const std::size_t colon = key.rfind(':');
          colon != std::string_view::npos && !key.starts_with("xmlns"))
        key.remove_prefix(colon + 1);
      rest = core::trimmed(rest.substr(equals + 1));
      if (rest.empty() || (rest[0] != '"' && rest[0] != '\'')) return {};
      const std::size_t end = rest.find(rest[0], 1);
      if (end == std::string_view::npos) return {};
      if (key == wanted) return rest.substr(1, end - 1);
      rest.remove_prefix(end + 1);
    }
    return {};
  }
};

/// Walks through the tags of a text of XML, which must outlive it. What is not XML is passed over as far as
/// it can be.
class Tags {
 public:
  explicit Tags(std::string_view text) : rest_(text) {}

  /// Goes to the next tag; false at the end. Comments and the like are passed over.
  bool next(Tag& tag) {
    for (;;) {
      const std::size_t open = rest_.find('<');
      if (open == std::string_view::npos) return false;
      rest_.remove_prefix(open);
      if (pass("<!--", "-->") || pass("<![CDATA[", "]]>") || pass("<?", "?>") || pass("<!", ">")) continue;
      const std::size_t end = end_of_tag();
      if (end == std::string_view::npos) {
        cut_short_ = true;
        return false;
      }
      std::string_view inside = rest_.substr(1, end - 1);
      rest_.remove_prefix(end + 1);
      tag.closes = inside.starts_with('/') || inside.ends_with('/');
      tag.opens = !inside.starts_with('/');
      if (!tag.opens) inside.remove_prefix(1);
      if (tag.opens && tag.closes) inside.remove_suffix(1);
      const std::size_t name_end = std::min(inside.find_first_of(" \t\r\n"), inside.size());
      tag.name = inside.substr(0, name_end);
      tag.name.remove_prefix(tag.name.find(':') + 1);  // npos + 1 is 0
      tag.attributes = inside.substr(name_end);
      return true;
    }
  }

  /// Returns whether the text ended within a tag.
  bool cut_short() const { return cut_short_; }

 private:
  bool pass(std::string_view start, std::string_view end) {
    if (!rest_.starts_with(start)) return false;
    const std::size_t at = rest_.find(end, start.size());
    rest_.remove_prefix(at == std::string_view::npos ? rest_.size() : at + end.size());
    return true;
  }
  std::size_t end_of_tag() const {
    char quote = 0;
    for (std::size_t i = 1; i < rest_.size(); ++i) {
      const char c = rest_[i];
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '>') {
        return i;
      }
    }
    return std::string_view::npos;
  }
  std::string_view rest_;
  bool cut_short_ = false;
};

}  // namespace phantom::geometry::detail
