#include "components/workspace_camera/cloud_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

namespace phantom::workspace_camera {
namespace {

using Points = std::vector<float>;

constexpr std::size_t kMaxPointOctets = 4096;
constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};

core::Status wrong(const std::string& what) { return core::Status::invalid_argument(what); }
std::string text(std::uint64_t number) { return std::to_string(number); }

/// The head of a file: lines of words.
class Lines {
 public:
  explicit Lines(std::string_view octets) : rest_(octets) {}
  /// Returns the next line's words; nothing: there is no line, or one longer than kMax.
  std::optional<std::vector<std::string_view>> next() {
    constexpr std::size_t kMax = 4096;
    const std::size_t end = rest_.substr(0, kMax).find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return words_of(line);
  }
  std::string_view rest() const { return rest_; }

  static std::vector<std::string_view> words_of(std::string_view line) {
    constexpr std::string_view kSpace = " \t\r\v\f";
    std::vector<std::string_view> words;
    for (std::size_t at = line.find_first_not_of(kSpace); at != std::string_view::npos;) {
      const std::size_t end = std::min(line.find_first_of(kSpace, at), line.size());
      words.push_back(line.substr(at, end - at));
      at = line.find_first_not_of(kSpace, end);
    }
    return words;
  }

 private:
  std::string_view rest_;
};

std::optional<std::uint64_t> whole_number(std::string_view word) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::optional<float> number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<float>::quiet_NaN();
  if (error != std::errc()) return std::nullopt;
  return static_cast<float>(value);
}

/// Where a coordinate is: in a point's octets, or the how manieth number of its line.
struct Coordinate {
  std::size_t offset = 0, column = 0;
  bool is_double = false;
};

/// What a file's head says of its points.
struct Layout {
  std::size_t points = 0, point_octets = 0, columns = 0;
  std::array<std::optional<Coordinate>, 3> at;
};

core::Status check(const Layout& layout) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!layout.at[axis]) return wrong("no field " + std::string(kAxes[axis]) + "; needed: x, y, z");
  if (layout.points == 0 || layout.points > kMaxCloudPoints)
    return wrong(text(layout.points) + " points; allowed: 1 to " + text(kMaxCloudPoints));
  if (layout.point_octets > kMaxPointOctets)
    return wrong("a point has " + text(layout.point_octets) + " octets; allowed: at most " +
                 text(kMaxPointOctets));
  return core::Status::ok();
}

template <class T>
T value_at(const char* from, bool big_endian) {
  std::array<char, sizeof(T)> octets;
  std::copy_n(from, sizeof(T), octets.begin());
  if (big_endian != (std::endian::native == std::endian::big)) std::ranges::reverse(octets);
  return std::bit_cast<T>(octets);
}

float value_of(const char* from, bool is_double, bool big_endian) {
  return is_double ? static_cast<float>(value_at<double>(from, big_endian))
                   : value_at<float>(from, big_endian);
}

core::Expected<Points> binary_points(const Layout& layout, std::string_view data, bool big_endian) {
  if (data.size() / layout.point_octets < layout.points)
    return wrong("the points have " + text(data.size()) +
                 " octets; needed: " + text(layout.points * layout.point_octets));
  Points xyz(3 * layout.points);
  for (std::size_t i = 0; i < layout.points; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      xyz[3 * i + axis] = value_of(data.data() + i * layout.point_octets + layout.at[axis]->offset,
                                   layout.at[axis]->is_double, big_endian);
  return xyz;
}

core::Expected<Points> ascii_points(const Layout& layout, std::string_view data) {
  if (data.size() / 2 < layout.points)  // a digit and an end of line at least
    return wrong("the points have " + text(data.size()) + " octets, too few for " + text(layout.points));
  Points xyz;
  xyz.reserve(3 * layout.points);
  Lines lines(data);
  std::string last(lines.rest().substr(lines.rest().rfind('\n') + 1));  // without an end of line
  for (std::size_t i = 0; i < layout.points; ++i) {
    auto words = lines.next();
    if (!words && lines.rest().size() == last.size()) words = Lines::words_of(std::exchange(last, ""));
    if (!words || words->size() < layout.columns)
      return wrong("point " + text(i + 1) + " has " + text(words ? words->size() : 0) +
                   " numbers; needed: " + text(layout.columns));
    for (const auto& at : layout.at) {
      const auto value = number((*words)[at->column]);
      if (!value)
        return wrong("point " + text(i + 1) + ": '" + std::string((*words)[at->column].substr(0, 32)) +
                     "' is no number");
      xyz.push_back(*value);
    }
  }
  return xyz;
}

// ---- PCD

/// The lines of a PCD file's head that count here.
struct PcdHead {
  std::vector<std::string> fields;
  std::vector<std::uint64_t> sizes, counts;
  std::vector<char> types;
  std::uint64_t width = 0, height = 0, points = 0;
  std::string data;
};

core::Expected<std::vector<std::uint64_t>> numbers_of(const std::vector<std::string_view>& words) {
  std::vector<std::uint64_t> numbers;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto value = whole_number(words[i]);
    if (!value || *value > kMaxCloudPoints)
      return wrong(std::string(words[0]) + ": '" + std::string(words[i].substr(0, 32)) +
                   "'; allowed: a whole number of at most " + text(kMaxCloudPoints));
    numbers.push_back(*value);
  }
  if (numbers.empty()) return wrong(std::string(words[0]) + " has no number");
  return numbers;
}

core::Expected<PcdHead> head_of_pcd(Lines& lines) {
  PcdHead head;
  while (head.data.empty()) {
    const auto words = lines.next();
    if (!words) return wrong("the head has no line DATA");
    if (words->empty() || words->front().starts_with('#')) continue;
    const std::string_view key = words->front();
    if (key == "DATA") {
      head.data = words->size() > 1 ? std::string((*words)[1]) : "nothing";
    } else if (key == "FIELDS") {
      head.fields.assign(words->begin() + 1, words->end());
    } else if (key == "TYPE") {
      for (std::size_t i = 1; i < words->size(); ++i) head.types.push_back((*words)[i].front());
    } else if (key == "SIZE" || key == "COUNT" || key == "WIDTH" || key == "HEIGHT" || key == "POINTS") {
      auto numbers = numbers_of(*words);
      if (!numbers) return numbers.status();
      if (key == "SIZE") head.sizes = *std::move(numbers);
      if (key == "COUNT") head.counts = *std::move(numbers);
      if (key == "WIDTH") head.width = numbers->front();
      if (key == "HEIGHT") head.height = numbers->front();
      if (key == "POINTS") head.points = numbers->front();
    } else if (key != "VERSION" && key != "VIEWPOINT") {
      return wrong("the head has a line '" + std::string(key.substr(0, 32)) +
                   "'; allowed: those of PCD 0.7, the last DATA");
    }
  }
  return head;
}

core::Expected<Layout> layout_of(PcdHead head) {
  if (head.counts.empty()) head.counts.assign(head.fields.size(), 1);
  const std::size_t fields = head.fields.size();
  if (head.sizes.size() != fields || head.types.size() != fields || head.counts.size() != fields)
    return wrong("FIELDS has " + text(fields) + " words; SIZE, TYPE and COUNT need as many");
  Layout layout;
  for (std::size_t i = 0; i < fields; ++i) {
    const auto axis = std::ranges::find(kAxes, head.fields[i]) - kAxes.begin();
    if (axis < 3) {
      if (head.types[i] != 'F' || (head.sizes[i] != 4 && head.sizes[i] != 8) || head.counts[i] != 1)
        return wrong("field " + head.fields[i] + " is of another type; allowed: F of 4 or 8 octets, once");
      layout.at[static_cast<std::size_t>(axis)] =
          Coordinate{layout.point_octets, layout.columns, head.sizes[i] == 8};
    }
    layout.point_octets += head.sizes[i] * head.counts[i];
    layout.columns += head.counts[i];
    if (layout.point_octets > kMaxPointOctets) break;
  }
  layout.points = head.width * head.height;
  if (head.points != 0 && head.points != layout.points)
    return wrong("POINTS is " + text(head.points) + "; allowed: WIDTH times HEIGHT, " + text(layout.points));
  if (core::Status status = check(layout); !status) return status;
  return layout;
}

core::Expected<Points> read_pcd(Lines lines) {
  auto head = head_of_pcd(lines);
  if (!head) return head.status();
  const std::string data = head->data;
  const auto layout = layout_of(*std::move(head));
  if (!layout) return layout.status();
  if (data == "ascii") return ascii_points(*layout, lines.rest());
  if (data == "binary") return binary_points(*layout, lines.rest(), false);
  return wrong("DATA is '" + data.substr(0, 32) +
               "'; allowed: ascii, binary (pcl_convert_pcd_ascii_binary makes them of binary_compressed)");
}

// ---- PLY

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  bool has_lists = false;
  Layout layout;
};

std::size_t octets_of(std::string_view type) {
  struct Type {
    std::string_view name;
    std::size_t octets;
  };
  constexpr std::array<Type, 16> kTypes{{{"char", 1},
                                         {"uchar", 1},
                                         {"int8", 1},
                                         {"uint8", 1},
                                         {"short", 2},
                                         {"ushort", 2},
                                         {"int16", 2},
                                         {"uint16", 2},
                                         {"int", 4},
                                         {"uint", 4},
                                         {"int32", 4},
                                         {"uint32", 4},
                                         {"float", 4},
                                         {"float32", 4},
                                         {"double", 8},
                                         {"float64", 8}}};
  const auto found = std::ranges::find(kTypes, type, &Type::name);
  return found == kTypes.end() ? 0 : found->octets;
}

core::Status add_property(const std::vector<std::string_view>& words, PlyElement& element) {
  if (words.size() > 1 && words[1] == "list") {
    element.has_lists = true;
    return core::Status::ok();
  }
  const std::size_t octets = words.size() == 3 ? octets_of(words[1]) : 0;
  if (octets == 0) return wrong("a property of element " + element.name + " is not 'property TYPE NAME'");
  Layout& layout = element.layout;
  const auto axis = std::ranges::find(kAxes, words[2]) - kAxes.begin();
  if (axis < 3) {
    if (!words[1].starts_with("float") && words[1] != "double")
      return wrong("property " + std::string(words[2]) + " is of another type; allowed: float, double");
    layout.at[static_cast<std::size_t>(axis)] = Coordinate{layout.point_octets, layout.columns, octets == 8};
  }
  layout.point_octets += octets;
  ++layout.columns;
  if (layout.columns > kMaxPointOctets) return wrong("element " + element.name + " has too many properties");
  return core::Status::ok();
}

/// The head of a PLY file.
struct PlyHead {
  std::string format;
  std::vector<PlyElement> elements;
};

core::Expected<PlyHead> head_of_ply(Lines& lines) {
  PlyHead head;
  for (;;) {
    const auto words = lines.next();
    if (!words) return wrong("the head has no line end_header");
    if (words->empty() || words->front() == "ply" || words->front() == "comment" ||
        words->front() == "obj_info")
      continue;
    const std::string_view key = words->front();
    if (key == "end_header") return head;
    if (key == "format" && words->size() == 3) {
      head.format = (*words)[1];
    } else if (key == "element" && words->size() == 3 && head.elements.size() < 64) {
      const auto count = whole_number((*words)[2]);
      if (!count || *count > kMaxCloudPoints)
        return wrong("element " + std::string((*words)[1].substr(0, 32)) +
                     " has a wrong number; allowed: 0 to " + text(kMaxCloudPoints));
      head.elements.push_back({std::string((*words)[1].substr(0, 32)), *count, false, {}});
    } else if (key == "property" && !head.elements.empty()) {
      if (core::Status status = add_property(*words, head.elements.back()); !status) return status;
    } else {
      return wrong("the head has a line '" + std::string(key.substr(0, 32)) +
                   "'; allowed: those of PLY 1.0, the last end_header");
    }
  }
}

/// Skips the elements before the points.
core::Status skip(const PlyElement& element, bool ascii, Lines& lines, std::string_view& data) {
  if (element.has_lists)
    return wrong("element " + element.name + " has lists, before the points; allowed: after them");
  if (!ascii) {
    const std::size_t octets = element.count * element.layout.point_octets;
    if (octets > data.size()) return wrong("element " + element.name + " is cut off");
    data.remove_prefix(octets);
    return core::Status::ok();
  }
  for (std::uint64_t i = 0; i < element.count; ++i)
    if (!lines.next()) return wrong("element " + element.name + " is cut off");
  data = lines.rest();
  return core::Status::ok();
}

core::Expected<Points> read_ply(Lines lines) {
  const auto head = head_of_ply(lines);
  if (!head) return head.status();
  const bool ascii = head->format == "ascii", big_endian = head->format == "binary_big_endian";
  if (!ascii && !big_endian && head->format != "binary_little_endian")
    return wrong("the format is '" + head->format.substr(0, 32) +
                 "'; allowed: ascii, binary_little_endian, binary_big_endian");
  std::string_view data = lines.rest();
  for (const PlyElement& element : head->elements) {
    if (element.name != "vertex") {
      if (core::Status status = skip(element, ascii, lines, data); !status) return status;
      continue;
    }
    if (element.has_lists) return wrong("element vertex has lists; allowed: none");
    Layout layout = element.layout;
    layout.points = element.count;
    if (core::Status status = check(layout); !status) return status;
    return ascii ? ascii_points(layout, data) : binary_points(layout, data, big_endian);
  }
  return wrong("there is no element vertex");
}

}  // namespace

core::Expected<std::vector<float>> read_cloud(std::string_view octets) {
  if (octets.starts_with("ply\n") || octets.starts_with("ply\r\n")) return read_ply(Lines(octets));
  if (octets.starts_with("# .PCD") || octets.starts_with("VERSION") || octets.starts_with("FIELDS"))
    return read_pcd(Lines(octets));
  return wrong("neither a PCD nor a PLY file by its first words");
}

}  // namespace phantom::workspace_camera
