#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/core/number_text.hpp"
#include "common/core/text.hpp"
#include "common/geometry/importer/polygons.hpp"

namespace phantom::geometry::detail {
namespace {

/// Returns whether a line goes on in the next one: it ends with a backslash, and holds numbers. Comments and
/// names may end with a backslash of their own, as paths of folders do.
bool goes_on(std::string_view line) {
  std::string_view rest = line;
  const std::string_view key = take_word(rest);
  constexpr std::string_view kNames[] = {"o", "g", "usemtl", "mtllib", "usemap", "maplib", "call", "csh"};
  if (key.starts_with('#') || std::ranges::find(kNames, key) != std::end(kNames)) return false;
  return core::trimmed(line).ends_with('\\');
}

/// The statements of the file.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {
    if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
  }
  /// Returns whether there is another statement; a view of it is valid until the next call.
  bool next(std::string_view& statement) {
    if (rest_.empty()) return false;
    number_ = passed_ + 1;
    std::string_view line = take_line();
    if (!goes_on(line)) {
      statement = line;
      return true;
    }
    joined_.clear();
    for (bool more = true; more; line = more ? take_line() : std::string_view()) {
      const std::string_view part = core::trimmed(line);
      more = part.ends_with('\\') && !rest_.empty();
      joined_.append(part.ends_with('\\') ? part.substr(0, part.size() - 1) : part).push_back(' ');
    }
    statement = joined_;
    return true;
  }
  [[noreturn]] void refuse(const std::string& why) const {
    throw UnreadableMesh("line " + std::to_string(number_) + " " + why);
  }
  std::uint64_t number() const { return number_; }

 private:
  std::string_view take_line() {
    ++passed_;
    return detail::take_line(rest_);
  }
  std::string_view rest_;
  std::string joined_;
  std::uint64_t passed_ = 0, number_ = 0;
};

class ObjReader {
 public:
  explicit ObjReader(std::string_view text) : lines_(text) {}
  Polygons read() {
    std::string_view rest;
    while (lines_.next(rest)) {
      rest = rest.substr(0, rest.find('#'));
      const std::string_view key = take_word(rest);
      if (key == "v") vertex(rest);
      if (key == "f" || key == "fo") face(rest);
      if (key == "curv" || key == "surf" || key == "bzp" || key == "bsp") surfaces_ = true;
      if (key == "call" || key == "csh") lines_.refuse("runs '" + std::string(key) + "', which is not done");
    }
    resolve();
    if (polygons_.ends.empty() && !polygons_.vertices.empty())
      throw UnreadableMesh(
          "it has vertices and no faces: it is a cloud of points, or of lines; mesh it first");
    if (surfaces_) polygons_.notes.push_back("its free-form curves and surfaces are left out");
    if (thin_ > 0)
      polygons_.notes.push_back(std::to_string(thin_) + " faces of fewer than three corners are left out");
    return std::move(polygons_);
  }

 private:
  struct Face {
    std::uint64_t line = 0, vertices = 0;  ///< vertices that stood before it
    std::size_t begin = 0, end = 0;        ///< of named_
  };

  void vertex(std::string_view rest) {
    Eigen::Vector3d position;
    for (double& coordinate : position) {
      std::string_view word = take_word(rest);
      if (word.empty()) lines_.refuse("has a vertex of fewer than three coordinates");
      const auto number = core::number_of(word);
      if (!number) lines_.refuse("has '" + std::string(word.substr(0, 40)) + "' as a coordinate");
      coordinate = *number;
    }
    polygons_.vertices.push_back(position);
  }

  void face(std::string_view rest) {
    Face face{.line = lines_.number(), .vertices = polygons_.vertices.size(), .begin = named_.size()};
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      std::string_view vertex = word.substr(0, word.find('/'));
      if (vertex.starts_with('+')) vertex.remove_prefix(1);
      std::int64_t index = 0;
      const auto [end, problem] = std::from_chars(vertex.data(), vertex.data() + vertex.size(), index);
      if (problem != std::errc() || end != vertex.data() + vertex.size() || index == 0)
        lines_.refuse("has a face with the corner '" + std::string(word.substr(0, 40)) +
                      "'; allowed: vertex/texture/normal, numbered from 1 or from −1 backwards");
      named_.push_back(index);
    }
    face.end = named_.size();
    if (face.end - face.begin < 3) {
      ++thin_;
      named_.resize(face.begin);
      return;
    }
    faces_.push_back(face);
  }

  /// A face may stand before its vertices; a negative index counts back from the face.
  void resolve() {
    const auto count = static_cast<std::int64_t>(polygons_.vertices.size());
    std::vector<std::uint32_t> corners;
    for (const Face& face : faces_) {
      corners.clear();
      for (std::size_t i = face.begin; i < face.end; ++i) {
        const std::int64_t index =
            named_[i] < 0 ? static_cast<std::int64_t>(face.vertices) + named_[i] : named_[i] - 1;
        if (index < 0 || index >= count)
          throw UnreadableMesh("line " + std::to_string(face.line) + " has a face that names vertex " +
                               std::to_string(named_[i]) + "; the file has " + std::to_string(count) +
                               " vertices");
        if (!polygons_.vertices[static_cast<std::size_t>(index)].allFinite())
          throw UnreadableMesh("line " + std::to_string(face.line) + " has a face that names vertex " +
                               std::to_string(named_[i]) + ", which has a coordinate that is not finite");
        corners.push_back(static_cast<std::uint32_t>(index));
      }
      polygons_.add_face(corners);
    }
  }

  Lines lines_;
  Polygons polygons_;
  std::vector<Face> faces_;
  std::vector<std::int64_t> named_;
  std::uint64_t thin_ = 0;
  bool surfaces_ = false;
};

}  // namespace

Polygons read_obj(std::string_view text) { return ObjReader(text).read(); }

}  // namespace phantom::geometry::detail
