#include <cmath>

#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

using geometry::ImplicitPtr;

constexpr Range kLength{1e-6, 1e4, "m"};
constexpr Range kCoordinate{-1e4, 1e4, "m"};
constexpr int kMaxNesting = 24;
constexpr const char* kAllowed =
    "sphere, cylinder, cone, box, prism, torus, union, intersection, difference, implicit";

ImplicitPtr read_nested(const ConfigReader& reader, int nesting);

ImplicitPtr read_sphere(const ConfigReader& shape) {
  return geometry::implicit_sphere(shape.number("radius_m", kLength));
}

ImplicitPtr read_cylinder(const ConfigReader& shape) {
  const double radius_m = shape.number("radius_m", kLength);
  return geometry::implicit_cylinder(radius_m, shape.number("height_m", kLength));
}

ImplicitPtr read_cone(const ConfigReader& shape) {
  const double radius_m = shape.number("radius_m", kLength);
  const double top_m = shape.number("top_radius_m", 0.0, {0, kLength.max, "m"});
  return geometry::implicit_cone(radius_m, top_m, shape.number("height_m", kLength));
}

ImplicitPtr read_box(const ConfigReader& shape) {
  const auto size_m = shape.numbers("size_m", kLength);
  if (size_m.size() != 3) throw shape.error("size_m", "needs three lengths, [x, y, z]");
  return geometry::implicit_box({size_m[0], size_m[1], size_m[2]});
}

ImplicitPtr read_prism(const ConfigReader& shape) {
  const auto c = shape.numbers("corners_m", kCoordinate);
  if (c.size() != 6)
    throw shape.error("corners_m", "needs three corners in the plane, [x1, y1, x2, y2, x3, y3]");
  const double twice_area_m2 = (c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]);
  if (!(std::abs(twice_area_m2) > 1e-12))
    throw shape.error("corners_m", "are in line; allowed: a triangle with an area");
  const double height_m = shape.number("height_m", kLength);
  return geometry::implicit_prism({Eigen::Vector2d(c[0], c[1]), {c[2], c[3]}, {c[4], c[5]}}, height_m);
}

ImplicitPtr read_torus(const ConfigReader& shape) {
  const double ring_m = shape.number("ring_radius_m", kLength);
  const double tube_m = shape.number("tube_radius_m", kLength);
  return geometry::implicit_torus(ring_m, tube_m);
}

std::vector<ImplicitPtr> read_parts(const ConfigReader& reader, const std::string& key, int nesting) {
  std::vector<ImplicitPtr> parts;
  for (const ConfigReader& part : reader.sections(key)) parts.push_back(read_nested(part, nesting + 1));
  if (parts.empty()) throw reader.error(key, "is empty; allowed: a list of at least one shape");
  return parts;
}

ImplicitPtr read_shape(const ConfigReader& reader, const std::string& key, int nesting) {
  if (key == "union") return geometry::implicit_union(read_parts(reader, key, nesting));
  if (key == "intersection") return geometry::implicit_intersection(read_parts(reader, key, nesting));
  if (key == "difference") return geometry::implicit_difference(read_parts(reader, key, nesting));
  const ConfigReader shape = reader.section(key);
  if (key == "sphere") return read_sphere(shape);
  if (key == "cylinder") return read_cylinder(shape);
  if (key == "cone") return read_cone(shape);
  if (key == "box") return read_box(shape);
  if (key == "prism") return read_prism(shape);
  if (key == "torus") return read_torus(shape);
  return read_formula_solid(shape);
}

ImplicitPtr read_nested(const ConfigReader& reader, int nesting) {
  if (nesting > kMaxNesting)
    throw ConfigError(reader.place() +
                      ": shapes are nested too deeply; allowed: " + std::to_string(kMaxNesting) + " levels");
  std::string found;
  for (const char* key : {"sphere", "cylinder", "cone", "box", "prism", "torus", "union", "intersection",
                          "difference", "implicit"}) {
    if (!reader.has(key)) continue;
    if (!found.empty())
      throw reader.error(key, "stands beside " + found + "; allowed: one shape of " + kAllowed);
    found = key;
  }
  if (found.empty()) throw ConfigError(reader.place() + ": names no shape; allowed: one of " + kAllowed);
  ImplicitPtr solid = read_shape(reader, found, nesting);
  return reader.has("pose") ? geometry::implicit_placed(std::move(solid), reader.pose("pose")) : solid;
}

}  // namespace

geometry::ImplicitPtr read_formula_solid(const ConfigReader& shape) {
  auto formula = geometry::Formula::parse(shape.text("f"), {"x", "y", "z"});
  if (!formula) throw shape.error("f", "is not a formula: " + formula.status().message());
  const Eigen::Vector3d min_m = shape.vector3("min_m"), max_m = shape.vector3("max_m");
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(min_m[axis]) > kCoordinate.max || std::abs(max_m[axis]) > kCoordinate.max)
      throw shape.error("max_m", "or min_m is out of range; allowed: -10000 to 10000 m");
    if (!(min_m[axis] < max_m[axis]))
      throw shape.error("max_m", "is not above min_m; allowed: min_m < max_m on every axis");
  }
  return geometry::implicit_formula(*std::move(formula), {min_m, max_m});
}

geometry::ImplicitPtr read_solid(const ConfigReader& reader) { return read_nested(reader, 0); }

}  // namespace phantom::runtime
