#include "common/geometry/mesh/stl_text.hpp"

#include <algorithm>

#include "common/core/number_text.hpp"
#include "common/core/text.hpp"
#include "common/geometry/mesh/vertex_welder.hpp"

namespace phantom::geometry {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

// An end of file of DOS (Ctrl-Z) ends nothing here.
bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0' || c == '\x1a'; }
bool ends_line(char c) { return c == '\n' || c == '\r'; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Returns whether a text, in any case, begins with a key word in lower case.
bool begins_with(std::string_view text, std::string_view word) {
  return text.size() >= word.size() &&
         std::equal(word.begin(), word.end(), text.begin(), [](char key, char c) { return key == lower(c); });
}

/// Words of a text, one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {
    if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
  }

  /// Goes to the next word; false at the end.
  bool next() {
    at_ += word_.size();
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
    std::size_t end = at_;
    while (end < text_.size() && !is_blank(text_[end])) ++end;
    word_ = text_.substr(at_, end - at_);
    return !word_.empty();
  }
  /// Goes to the next word; of "end facet" to both, as one key word.
  bool next_key() {
    if (!next()) return false;
    is_end_ = false;
    if (!is("end")) return true;
    is_end_ = next();
    return is_end_;
  }
  /// Returns whether the word is this one, in lower case.
  bool is(std::string_view key) const { return !is_end_ && equals(key); }
  /// Returns whether the key word is "end" and this one.
  bool is_end_of(std::string_view key) const {
    if (is_end_) return equals(key);
    return word_.size() == 3 + key.size() && begins_with(word_, "end") && begins_with(word_.substr(3), key);
  }
  /// Passes over the rest of the line: the name of a solid. A facet in the same line is not part of it.
  void pass_line() {
    at_ += word_.size();
    word_ = {};
    std::size_t end = at_;
    while (end < text_.size() && !ends_line(text_[end])) ++end;
    const std::string line = core::lower_case(text_.substr(at_, std::min<std::size_t>(end - at_, 4096)));
    for (std::size_t facet = line.find("facet"); facet != std::string::npos;
         facet = line.find("facet", facet + 1)) {
      const std::string_view rest = core::trimmed(std::string_view(line).substr(facet + 5));
      if (!rest.starts_with("normal")) continue;
      const std::string_view number = core::trimmed(rest.substr(6));
      if (number.empty() || std::string_view("+-.0123456789").find(number.front()) == std::string_view::npos)
        continue;
      at_ += facet;
      return;
    }
    at_ = end;
  }
  std::string_view word() const { return word_; }
  std::string place() const {
    const std::string_view before = text_.substr(0, at_);
    const auto lines = std::ranges::count(before, '\n');
    return "line " + std::to_string(1 + (lines > 0 ? lines : std::ranges::count(before, '\r')));
  }

 private:
  bool equals(std::string_view key) const { return word_.size() == key.size() && begins_with(word_, key); }

  std::string_view text_, word_;
  std::size_t at_ = 0;
  bool is_end_ = false;
};

/// Reads a number, also one with a plus or with the exponent of a Fortran program.
bool read_number(std::string_view word, float& value) {
  auto read = core::number_of(word);
  if (!read) {
    std::string other(word);
    std::ranges::replace_if(
        other, [](char c) { return c == 'd' || c == 'D'; }, 'e');
    read = core::number_of(other);
  }
  if (read) value = static_cast<float>(*read);
  return read.has_value();
}

enum class Step { kRead, kEnded, kWrong };

class Reader {
 public:
  Reader(std::string_view text, std::uint32_t most, TextStl& stl)
      : words_(text), most_(most), stl_(stl), corners_(stl.mesh) {}

  void read() {
    bool open = false;
    while (stl_.problem.empty() && !stl_.too_many && words_.next_key()) {
      if (words_.is("facet")) {
        if (!facet()) break;
      } else if (words_.is("solid")) {
        open = true;
        words_.pass_line();
      } else if (words_.is_end_of("solid")) {
        open = false;
        words_.pass_line();
      } else {
        pass_over();
      }
    }
    if (stl_.problem.empty() && !stl_.too_many && open && !cut_)
      stl_.notes.emplace_back("has no 'endsolid' at its end: was it cut short?");
    stl_.mesh.collapsed = corners_.collapsed();
    stl_.mesh.finite = corners_.finite();
  }

 private:
  /// Reads a facet from behind its first word. Returns false at the text's end, or what follows is no facet.
  bool facet() {
    std::vector<std::uint32_t> polygon;
    const Step step = facet_parts(polygon);
    if (step == Step::kEnded) {
      cut_ = true;
      stl_.notes.push_back("ends within a facet, in " + words_.place() + ": was it cut short?");
    }
    if (step == Step::kWrong) {
      stl_.problem = words_.place() + ": '" + std::string(words_.word().substr(0, 40)) +
                     "' where a facet has: " + wanted_;
    }
    if (step != Step::kRead) return false;
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      if (count_++ == most_) {
        stl_.too_many = true;
        return false;
      }
      corners_.triangle({polygon[0], polygon[i - 1], polygon[i]});
    }
    return true;
  }
  Step facet_parts(std::vector<std::uint32_t>& polygon) {
    if (!words_.next()) return Step::kEnded;
    if (words_.is("normal")) {
      for (int i = 0; i < 3; ++i)  // of no use, and often no number
        if (!words_.next()) return Step::kEnded;
      if (!words_.next()) return Step::kEnded;
    }
    if (const Step step = expect(words_.is("outer"), "outer loop"); step != Step::kRead) return step;
    if (!words_.next()) return Step::kEnded;
    if (const Step step = expect(words_.is("loop"), "outer loop"); step != Step::kRead) return step;
    for (;;) {
      if (!words_.next_key()) return Step::kEnded;
      if (words_.is_end_of("loop")) break;
      if (const Step step = expect(words_.is("vertex"), "vertex or endloop"); step != Step::kRead)
        return step;
      Eigen::Vector3f corner;
      for (float& coordinate : corner) {
        if (!words_.next()) return Step::kEnded;
        if (const Step step = expect(read_number(words_.word(), coordinate), "a number"); step != Step::kRead)
          return step;
      }
      polygon.push_back(corners_.vertex(corner));
    }
    if (const Step step = expect(polygon.size() >= 3, "three vertices"); step != Step::kRead) return step;
    if (!words_.next_key()) return Step::kEnded;
    return expect(words_.is_end_of("facet"), "endfacet");
  }
  Step expect(bool holds, const char* what) {
    wanted_ = what;
    return holds ? Step::kRead : Step::kWrong;
  }
  void pass_over() {
    constexpr std::size_t kMaxNotes = 3;
    if (++passed_ <= kMaxNotes) {
      stl_.notes.push_back(words_.place() + " is passed over: '" + std::string(words_.word().substr(0, 40)) +
                           "' is no key word of a text STL");
    }
    words_.pass_line();
  }

  Words words_;
  std::uint32_t most_, count_ = 0;
  TextStl& stl_;
  detail::VertexWelder corners_;
  const char* wanted_ = "";
  std::size_t passed_ = 0;
  bool cut_ = false;
};

}  // namespace

bool looks_like_text_stl(std::span<const std::uint8_t> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), std::min(head.size(), kStlLookBytes));
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const auto binary = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < ' ' && !is_blank(c);
  };
  const std::size_t padding = text.find_last_not_of('\0') + 1;
  if (text.substr(0, padding).find('\0') != std::string_view::npos || std::ranges::any_of(text, binary))
    return false;
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  return begins_with(text, "solid") && (text.size() == 5 || is_blank(text[5]));
}

TextStl read_text_stl(std::string_view text, std::uint32_t max_triangles) {
  TextStl stl;
  Reader(text, max_triangles, stl).read();
  return stl;
}

}  // namespace phantom::geometry
