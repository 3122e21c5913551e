#include <cmath>

#include "common/runtime/cell/cell_parts.hpp"

namespace phantom::runtime {
namespace {

using geometry::ImplicitPtr;

constexpr int kMaxNesting = 24, kMaxShapes = 4096;

ImplicitPtr read_box(const Fields& box) {
  std::vector<double> size_m;
  box.numbers("size_m", size_m);
  box.check(size_m.size() == 3, "size_m", "needs three lengths, [x, y, z]");
  return geometry::implicit_box({size_m[0], size_m[1], size_m[2]});
}

ImplicitPtr read_prism(const Fields& prism) {
  std::vector<double> c;
  prism.numbers("corners_m", c);
  prism.check(c.size() == 6, "corners_m", "needs three corners in the plane, [x1, y1, x2, y2, x3, y3]");
  const double twice_area_m2 = (c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]);
  prism.check(std::abs(twice_area_m2) > 1e-12, "corners_m", "are in line; allowed: a triangle with an area");
  return geometry::implicit_prism({Eigen::Vector2d(c[0], c[1]), {c[2], c[3]}, {c[4], c[5]}},
                                  prism.value("height_m"));
}

ImplicitPtr read_part(const Fields& fields, int nesting, int& shapes);

std::vector<ImplicitPtr> read_parts(const Fields& fields, const std::string& key, int nesting, int& shapes) {
  std::vector<ImplicitPtr> parts;
  for (const Fields& part : fields.sections(key))
    parts.push_back(read_part(part.as("shape"), nesting + 1, shapes));
  fields.check(!parts.empty(), key, "is empty; allowed: a list of at least one shape");
  return parts;
}

ImplicitPtr read_kind(const Fields& fields, const std::string& kind, int nesting, int& shapes) {
  if (kind == "union") return geometry::implicit_union(read_parts(fields, kind, nesting, shapes));
  if (kind == "intersection")
    return geometry::implicit_intersection(read_parts(fields, kind, nesting, shapes));
  if (kind == "difference") return geometry::implicit_difference(read_parts(fields, kind, nesting, shapes));
  const Fields shape = fields.section(kind);
  if (kind == "sphere") return geometry::implicit_sphere(shape.value("radius_m"));
  if (kind == "cylinder")
    return geometry::implicit_cylinder(shape.value("radius_m"), shape.value("height_m"));
  if (kind == "cone")
    return geometry::implicit_cone(shape.value("radius_m"), shape.value("top_radius_m"),
                                   shape.value("height_m"));
  if (kind == "box") return read_box(shape);
  if (kind == "prism") return read_prism(shape);
  if (kind == "torus")
    return geometry::implicit_torus(shape.value("ring_radius_m"), shape.value("tube_radius_m"));
  return read_formula_solid(shape);
}

/// Reads a shape; `shapes` counts all that were read for the object.
ImplicitPtr read_part(const Fields& fields, int nesting, int& shapes) {
  if (nesting > kMaxNesting)
    throw ConfigError(fields.place() +
                      ": shapes are nested too deeply; allowed: " + std::to_string(kMaxNesting) + " levels");
  if (++shapes > kMaxShapes)
    throw ConfigError(fields.place() +
                      ": is one shape too many of this object; allowed: " + std::to_string(kMaxShapes));
  ImplicitPtr solid = read_kind(fields, fields.one_of("sphere", "shape"), nesting, shapes);
  return fields.has("pose") ? geometry::implicit_placed(std::move(solid), fields.pose("pose")) : solid;
}

}  // namespace

geometry::ImplicitPtr read_formula_solid(const Fields& shape) {
  auto formula = geometry::Formula::parse(shape.text("f"), {"x", "y", "z"});
  if (!formula) throw shape.error("f", "is not a formula: " + formula.status().message());
  const Eigen::Vector3d min_m = shape.vector3("min_m"), max_m = shape.vector3("max_m");
  shape.check((min_m.array() < max_m.array()).all(), "max_m",
              "is not above min_m; allowed: min_m < max_m on every axis");
  return geometry::implicit_formula(*std::move(formula), {min_m, max_m});
}

geometry::ImplicitPtr read_shape(const Fields& fields) {
  int shapes = 0;
  return read_part(fields, 0, shapes);
}

}  // namespace phantom::runtime
