#include "common/geometry/mesh/mesh_units.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "common/core/text.hpp"

namespace phantom::geometry {
namespace {

struct NamedUnit {
  std::string_view name;
  double scale;
};

// The unit names of 3MF and AMF, in singular as in the standards.
constexpr NamedUnit kUnits[] = {{"micron", 1e-6},     {"micrometer", 1e-6}, {"millimeter", 1e-3},
                                {"centimeter", 1e-2}, {"inch", 0.0254},     {"feet", 0.3048},
                                {"foot", 0.3048},     {"meter", 1.0}};

// DXF's $INSUNITS by number; 0 means "no unit".
constexpr double kDxfUnits[] = {0,         0.0254,    0.3048, 1609.344, 1e-3, 1e-2, 1.0, 1e3,
                                0.0254e-6, 0.0254e-3, 0.9144, 1e-10,    1e-9, 1e-6, 0.1};

using core::trimmed;

std::string text_of(double value) { return core::formatted("%.4g", value); }

/// Parses a plausible scale: finite and positive.
std::optional<double> number(std::string_view text) {
  text = trimmed(text);
  double value = 0.0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || !std::isfinite(value) || !(value > 0)) return {};
  return value;
}

/// Returns the text between `open` and `close`, searching from `from`.
std::optional<std::string_view> between(std::string_view text, std::string_view open, std::string_view close,
                                        std::size_t from = 0) {
  const std::size_t start = text.find(open, from);
  if (start == std::string_view::npos) return {};
  const std::size_t first = start + open.size(), end = text.find(close, first);
  if (end == std::string_view::npos) return {};
  return text.substr(first, end - first);
}

/// Returns the value of an attribute of the first tag with this name, e.g. tag "<unit", attribute "meter".
std::optional<std::string_view> attribute(std::string_view text, std::string_view tag,
                                          std::string_view name) {
  for (std::size_t at = text.find(tag); at != std::string_view::npos; at = text.find(tag, at + 1)) {
    const std::size_t after = at + tag.size();
    if (after >= text.size() || !std::isspace(static_cast<unsigned char>(text[after]))) continue;
    const std::string_view inside = text.substr(after, text.find('>', after) - after);
    for (std::size_t i = inside.find(name); i != std::string_view::npos; i = inside.find(name, i + 1)) {
      if (i == 0 || !std::isspace(static_cast<unsigned char>(inside[i - 1]))) continue;
      std::string_view rest = trimmed(inside.substr(i + name.size()));
      if (rest.empty() || rest.front() != '=') continue;
      rest = trimmed(rest.substr(1));
      if (rest.empty() || (rest.front() != '"' && rest.front() != '\'')) continue;
      const std::size_t end = rest.find(rest.front(), 1);
      if (end != std::string_view::npos) return rest.substr(1, end - 1);
    }
    return {};
  }
  return {};
}

std::optional<double> named_unit(std::string_view name) {
  const std::string lower = core::lower_case(trimmed(name));
  for (const NamedUnit& unit : kUnits) {
    if (unit.name == lower) return unit.scale;
  }
  return {};
}

DeclaredFrame collada(std::string_view head) {
  DeclaredFrame frame;
  const std::string_view asset = between(head, "<asset", "</asset>").value_or("");
  if (const auto meter = attribute(asset, "<unit", "meter")) frame.scale = number(*meter);
  const std::string_view up = trimmed(between(asset, "<up_axis>", "</up_axis>").value_or(""));
  if (up == "X_UP") frame.up = UpAxis::kX;
  if (up == "Z_UP") frame.up = UpAxis::kZ;
  if (up == "Y_UP") frame.up = UpAxis::kY;
  return frame;
}

/// Metric (key = "distance") {float {0.01}}   Metric (key = "up") {string {"z"}}
DeclaredFrame open_gex(std::string_view head) {
  DeclaredFrame frame;
  for (std::size_t at = head.find("Metric"); at != std::string_view::npos; at = head.find("Metric", at + 1)) {
    const std::string_view key = between(head, "\"", "\"", at).value_or("");
    const std::size_t brace = head.find('{', at);
    if (brace == std::string_view::npos) break;
    const std::string_view value = between(head, "{", "}", brace + 1).value_or("");
    if (key == "distance") frame.scale = number(value);
    if (key == "up") frame.up = value.find('y') != std::string_view::npos ? UpAxis::kY : UpAxis::kZ;
  }
  return frame;
}

DeclaredFrame dxf(std::string_view head) {
  DeclaredFrame frame;
  const std::size_t at = head.find("$INSUNITS");
  if (at == std::string_view::npos) return frame;
  // The line with the variable's name is followed by a line with the group code 70, then the value.
  const std::size_t code = head.find('\n', at);
  const std::size_t value = code == std::string_view::npos ? code : head.find('\n', code + 1);
  if (value == std::string_view::npos) return frame;
  const auto unit = number(head.substr(value + 1, head.find('\n', value + 1) - value - 1));
  if (unit && *unit >= 1 && *unit < static_cast<double>(std::size(kDxfUnits)))
    frame.scale = kDxfUnits[static_cast<std::size_t>(*unit)];
  return frame;
}

}  // namespace

bool starts_with_any(std::string_view text, std::initializer_list<std::string_view> starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](std::string_view start) { return text.starts_with(start); });
}

std::string unit_name(double scale) {
  if (scale == 1.0) return "metres";
  if (scale == 1e-3) return "millimetres";
  if (scale == 1e-2) return "centimetres";
  if (scale == 1e-6) return "micrometres";
  if (scale == 0.0254) return "inches";
  if (scale == 0.3048) return "feet";
  return text_of(scale) + " m";
}

UnitGuess guess_unit(const std::array<double, 3>& extents) {
  const double greatest = std::max({extents[0], extents[1], extents[2]});
  const std::string size = text_of(extents[0]) + " × " + text_of(extents[1]) + " × " + text_of(extents[2]);
  if (greatest <= kMaxPlausibleExtent_m) {
    return {1.0, "metres are assumed, as its " + size + " units are then a plausible size"};
  }
  return {1e-3, "millimetres are assumed, as its " + size + " units would reach farther than " +
                    text_of(kMaxPlausibleExtent_m) + " m otherwise"};
}

UpAxis guess_up(std::string_view format) {
  // These are formats of renderers; CAD and 3D printing use +z up.
  return starts_with_any(format,
                         {"Direct3D", "LightWave", "Ogre3D", "BlitzBasic", "Irrlicht", "Milkshape", "MMD"})
             ? UpAxis::kY
             : UpAxis::kZ;
}

std::string root_model_of_3mf(std::string_view relationships) {
  constexpr std::string_view kTag = "<Relationship";
  for (std::size_t at = relationships.find(kTag); at != std::string_view::npos;
       at = relationships.find(kTag, at + 1)) {
    const std::string_view one = relationships.substr(at, relationships.find('>', at) - at);
    const std::string_view type = attribute(one, kTag, "Type").value_or("");
    if (!type.ends_with("/3dmodel")) continue;
    std::string_view target = attribute(one, kTag, "Target").value_or("");
    if (target.starts_with('/')) target.remove_prefix(1);  // names in the package have no leading slash
    return std::string(target);
  }
  return {};
}

DeclaredFrame declared_in_text(std::string_view format, std::string_view head) {
  if (format.starts_with("Collada")) {
    DeclaredFrame frame = collada(head);
    // Defaults of the standard (COLLADA 1.4.1, elements unit and up_axis).
    if (!frame.scale) frame.scale = 1.0;
    if (!frame.up) frame.up = UpAxis::kY;
    return frame;
  }
  if (format.starts_with("Additive") || format.starts_with("3mf")) {
    const bool is_3mf = format.starts_with("3mf");
    const auto name = attribute(head, is_3mf ? "<model" : "<amf", "unit");
    // Both standards default to millimetres; +z is up from the printer's bed.
    return {name ? named_unit(*name) : std::optional<double>(1e-3), UpAxis::kZ};
  }
  if (format.starts_with("Open Game Engine Exchange")) {
    DeclaredFrame frame = open_gex(head);
    if (!frame.scale) frame.scale = 1.0;  // default of OpenGEX, structure Metric
    if (!frame.up) frame.up = UpAxis::kZ;
    return frame;
  }
  if (format.starts_with("Drawing Interchange")) return dxf(head);
  return {};
}

}  // namespace phantom::geometry
