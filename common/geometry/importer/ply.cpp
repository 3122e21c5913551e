#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "common/core/number_text.hpp"
#include "common/core/text.hpp"
#include "common/geometry/importer/polygons.hpp"

namespace phantom::geometry::detail {
namespace {

enum class Kind { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64 };

constexpr std::size_t bytes_of(Kind kind) {
  constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kBytes[static_cast<std::size_t>(kind)];
}

Kind kind_of(std::string_view name) {
  constexpr std::pair<std::string_view, Kind> kNames[] = {
      {"char", Kind::kInt8},       {"uchar", Kind::kUint8},    {"short", Kind::kInt16},
      {"ushort", Kind::kUint16},   {"int", Kind::kInt32},      {"uint", Kind::kUint32},
      {"float", Kind::kFloat32},   {"double", Kind::kFloat64}, {"int8", Kind::kInt8},
      {"uint8", Kind::kUint8},     {"int16", Kind::kInt16},    {"uint16", Kind::kUint16},
      {"int32", Kind::kInt32},     {"uint32", Kind::kUint32},  {"float32", Kind::kFloat32},
      {"float64", Kind::kFloat64}, {"int64", Kind::kInt64},    {"uint64", Kind::kUint64}};
  const std::string lower = core::lower_case(name);
  for (const auto& [known, kind] : kNames)
    if (lower == known) return kind;
  throw UnreadableMesh("its head has the type '" + std::string(name.substr(0, 40)) +
                       "'; allowed: char, uchar, short, ushort, int, uint, float, double, int8 to float64");
}

struct Property {
  std::string name;
  Kind kind = Kind::kFloat32;
  std::optional<Kind> count;  ///< of a list: the type of its length
};
struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};
enum class Form { kText, kLittleEndian, kBigEndian };
struct Head {
  std::optional<Form> form;
  std::vector<Element> elements;
};

void read_property(std::string_view line, Head& head) {
  if (head.elements.empty()) throw UnreadableMesh("its head has a property before the first element");
  Property property;
  std::string_view kind = take_word(line);
  if (kind == "list") {
    property.count = kind_of(take_word(line));
    if (*property.count == Kind::kFloat32 || *property.count == Kind::kFloat64)
      throw UnreadableMesh("its head has a list with a length that is no whole number");
    kind = take_word(line);
  }
  property.kind = kind_of(kind);
  property.name = take_word(line);
  head.elements.back().properties.push_back(std::move(property));
}

void read_form(std::string_view line, Head& head) {
  const std::string_view form = take_word(line);
  if (form == "ascii") head.form = Form::kText;
  if (form == "binary_little_endian") head.form = Form::kLittleEndian;
  if (form == "binary_big_endian") head.form = Form::kBigEndian;
  if (!head.form)
    throw UnreadableMesh("its format is '" + std::string(form.substr(0, 40)) +
                         "'; allowed: ascii, binary_little_endian, binary_big_endian");
}

Head read_head(std::string_view& rest) {
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  const std::size_t first_end = rest.find_first_of("\r\n");
  const bool ends_by_cr = rest.substr(std::min(first_end, rest.size())).starts_with('\r') &&
                          !rest.substr(std::min(first_end, rest.size())).starts_with("\r\n");
  if (core::lower_case(core::trimmed(take_line(rest))) != "ply")
    throw UnreadableMesh("its first line is not 'ply'");
  Head head;
  while (!rest.empty()) {
    std::string_view line = take_line(rest);
    const std::string_view key = take_word(line);
    if (key == "end_header") {
      // Where lines end by \r alone, a \n behind it is the body's first byte.
      if (ends_by_cr && *(rest.data() - 1) == '\n') rest = {rest.data() - 1, rest.size() + 1};
      if (!head.form) throw UnreadableMesh("its head has no format");
      return head;
    }
    if (key == "format") read_form(line, head);
    if (key == "property") read_property(line, head);
    if (key != "element") continue;  // comments, obj_info
    Element element{.name = std::string(take_word(line)), .properties = {}};
    const std::string_view count = take_word(line);
    const auto [end, problem] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (problem != std::errc() || end != count.data() + count.size())
      throw UnreadableMesh("its head has no number of elements '" + element.name + "'");
    head.elements.push_back(std::move(element));
  }
  throw UnreadableMesh("its head has no end_header: was it cut short?");
}

/// Reads the numbers of an element, one after the other.
class Body {
 public:
  /// `by_lines`: in a text each element stands on a line of its own; else its numbers may stand anywhere.
  Body(std::string_view bytes, Form form, bool by_lines) : rest_(bytes), form_(form), by_lines_(by_lines) {}

  /// Begins element `number` of `count`.
  void begin(const Element& element, std::uint64_t number) {
    element_ = &element;
    number_ = number;
    if (form_ != Form::kText || !by_lines_ || element.properties.empty()) return;
    if (!core::trimmed(line_).empty()) ++longer_;
    do {
      if (rest_.empty()) cut_short();
      line_ = take_line(rest_);
    } while (core::trimmed(line_).empty());
  }
  double number(Kind kind) { return form_ == Form::kText ? text_number() : binary_number(kind); }
  std::int64_t whole(Kind kind) {
    const double value = number(kind);
    if (value != std::floor(value) || std::abs(value) > 4294967295.0)
      refuse("has a number that is no index or length");
    return static_cast<std::int64_t>(value);
  }
  /// Ends the body. Adds what is left of it to `notes`.
  void finish(std::vector<std::string>& notes) {
    if (!core::trimmed(line_).empty()) ++longer_;
    if (longer_ > 0)
      notes.push_back(std::to_string(longer_) +
                      " lines have more numbers than the head declares: the last ones are passed over");
    const std::string_view left = form_ == Form::kText ? core::trimmed(rest_) : rest_;
    if (!left.empty())
      notes.push_back("has " + std::to_string(left.size()) +
                      " bytes after what its head declares: they are passed over");
  }
  bool is_used_up() const { return core::trimmed(line_).empty() && core::trimmed(rest_).empty(); }
  [[noreturn]] void refuse(const std::string& why) const {
    throw UnreadableMesh(element_->name + " " + std::to_string(number_) + " of " +
                         std::to_string(element_->count) + " " + why);
  }

 private:
  [[noreturn]] void cut_short() const {
    throw UnreadableMesh("it declares " + std::to_string(element_->count) + " of '" + element_->name +
                         "' and ends after " + std::to_string(number_) + ": was it cut short?");
  }
  double text_number() {
    std::string_view word = take_word(line_);
    while (word.empty() && !by_lines_ && !rest_.empty()) {
      line_ = take_line(rest_);
      word = take_word(line_);
    }
    if (word.empty() && !by_lines_) cut_short();
    if (word.empty()) refuse("has fewer numbers than the head declares");
    const auto value = core::number_of(word);
    if (!value) refuse("has '" + std::string(word.substr(0, 40)) + "', which is no number");
    return *value;
  }
  double binary_number(Kind kind) {
    const std::size_t size = bytes_of(kind);
    if (rest_.size() < size) cut_short();
    std::array<char, 8> own{};
    std::copy_n(rest_.data(), size, own.data());
    rest_.remove_prefix(size);
    if ((form_ == Form::kBigEndian) == (std::endian::native == std::endian::little))
      std::reverse(own.data(), own.data() + size);
    const auto as = [&own]<class Number>(Number value) {
      std::memcpy(&value, own.data(), sizeof value);
      return static_cast<double>(value);
    };
    switch (kind) {
      case Kind::kInt8:
        return as(std::int8_t{});
      case Kind::kUint8:
        return as(std::uint8_t{});
      case Kind::kInt16:
        return as(std::int16_t{});
      case Kind::kUint16:
        return as(std::uint16_t{});
      case Kind::kInt32:
        return as(std::int32_t{});
      case Kind::kUint32:
        return as(std::uint32_t{});
      case Kind::kInt64:
        return as(std::int64_t{});
      case Kind::kUint64:
        return as(std::uint64_t{});
      case Kind::kFloat32:
        return as(float{});
      case Kind::kFloat64:
        return as(double{});
    }
    return 0.0;
  }

  std::string_view rest_, line_;
  Form form_;
  bool by_lines_;
  std::uint64_t longer_ = 0;  // lines with more numbers than declared
  const Element* element_ = nullptr;
  std::uint64_t number_ = 0;
};

/// Of one element: its scalars by property, and its list of vertices.
struct Row {
  Eigen::Vector3d position = Eigen::Vector3d::Constant(NAN);
  std::vector<std::int64_t> list;
};

bool lists_vertices(const Property& property) {
  return property.count && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void read_row(Body& body, const Element& element, Row& row) {
  row.list.clear();
  row.position.setConstant(NAN);
  for (const Property& property : element.properties) {
    if (!property.count) {
      const double value = body.number(property.kind);
      if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
        row.position[property.name[0] - 'x'] = value;
      continue;
    }
    const std::int64_t length = body.whole(*property.count);
    if (length < 0) body.refuse("has a list of negative length");
    const bool wanted = lists_vertices(property);
    for (std::int64_t i = 0; i < length; ++i) {
      if (wanted) {
        row.list.push_back(body.whole(property.kind));
      } else {
        body.number(property.kind);
      }
    }
  }
}

class Faces {
 public:
  Faces(const Body& body, std::uint64_t vertices, Polygons& polygons)
      : body_(body), vertices_(vertices), polygons_(polygons) {}

  void polygon(const Row& row) {
    if (row.list.size() < 3) {
      ++thin_;
      return;
    }
    face_.clear();
    for (const std::int64_t index : row.list) face_.push_back(checked(index));
    polygons_.add_face(face_);
  }
  /// A strip: each vertex makes a triangle with the two before it, turned in turn; −1 ends it.
  void strip(const Row& row) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < row.list.size(); ++i) {
      if (row.list[i] == -1) begin = i + 1;
      if (row.list[i] == -1 || i < begin + 2) continue;
      const bool odd = (i - begin) % 2 == 1;
      const std::uint32_t a = checked(row.list[i - 2]), b = checked(row.list[i - 1]),
                          c = checked(row.list[i]);
      if (a == b || b == c || c == a) continue;  // joins parts of a strip
      polygons_.add_face(std::array{odd ? b : a, odd ? a : b, c});
    }
  }
  void finish() {
    if (thin_ > 0)
      polygons_.notes.push_back(std::to_string(thin_) + " faces of fewer than three corners are left out");
  }

 private:
  std::uint32_t checked(std::int64_t index) const {
    if (index < 0 || static_cast<std::uint64_t>(index) >= vertices_)
      body_.refuse("names vertex " + std::to_string(index) + "; allowed: 0 to " +
                   std::to_string(static_cast<std::int64_t>(vertices_) - 1));
    return static_cast<std::uint32_t>(index);
  }
  const Body& body_;
  std::uint64_t vertices_, thin_ = 0;
  Polygons& polygons_;
  std::vector<std::uint32_t> face_;
};

}  // namespace

namespace {

const Element* element_of(const Head& head, std::string_view name) {
  const auto found = std::ranges::find(head.elements, name, &Element::name);
  return found == head.elements.end() ? nullptr : &*found;
}

/// Refuses a file that declares no face, and says what it has in place of them.
void check_faces(const Head& head) {
  const Element* vertices = element_of(head, "vertex");
  if (vertices == nullptr) throw UnreadableMesh("its head declares no vertices");
  for (const char* axis : {"x", "y", "z"}) {
    const bool there = std::ranges::any_of(vertices->properties,
                                           [&](const Property& p) { return !p.count && p.name == axis; });
    if (!there) throw UnreadableMesh(std::string("its vertices have no coordinate '") + axis + "'");
  }
  if (element_of(head, "range_grid") != nullptr)
    throw UnreadableMesh("it is a grid of ranges, which has no faces: mesh it first");
  std::string other;
  bool any = false;
  for (const Element& element : head.elements) {
    if (element.name != "face" && element.name != "tristrips") continue;
    any = any || std::ranges::any_of(element.properties, lists_vertices);
    if (element.count == 0) continue;
    for (const Property& property : element.properties) core::add_to_list(other, "'" + property.name + "'");
  }
  if (!any && !other.empty())
    throw UnreadableMesh("its faces have no list 'vertex_indices' or 'vertex_index', but " + other);
  if (!any) throw UnreadableMesh("its head declares no faces: it is a cloud of points; mesh it first");
}

Polygons read_body(const Head& head, std::string_view bytes, bool by_lines) {
  Polygons polygons;
  Body body(bytes, *head.form, by_lines);
  Faces faces(body, element_of(head, "vertex")->count, polygons);
  Row row;
  for (const Element& element : head.elements) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      body.begin(element, i);
      read_row(body, element, row);
      if (element.name == "face") faces.polygon(row);
      if (element.name == "tristrips") faces.strip(row);
      if (element.name == "vertex") polygons.vertices.push_back(row.position);
    }
  }
  // A scanner gives points that it did not see no coordinates; no face may name them.
  for (const std::uint32_t corner : polygons.corners) {
    if (!polygons.vertices[corner].allFinite())
      throw UnreadableMesh("a face names vertex " + std::to_string(corner) + " of " +
                           std::to_string(polygons.vertices.size()) +
                           ", which has a coordinate that is missing or not finite");
  }
  faces.finish();
  if (!by_lines && !body.is_used_up()) throw UnreadableMesh("it has more numbers than its head declares");
  body.finish(polygons.notes);
  return polygons;
}

}  // namespace

Polygons read_ply(std::string_view bytes) {
  const Head head = read_head(bytes);
  check_faces(head);
  try {
    return read_body(head, bytes, true);
  } catch (const UnreadableMesh&) {
    if (*head.form != Form::kText) throw;
    try {  // elements that do not stand on lines of their own, if all numbers then fit
      return read_body(head, bytes, false);
    } catch (const UnreadableMesh&) {  // the first reason is the better one
    }
    throw;
  }
}

}  // namespace phantom::geometry::detail
