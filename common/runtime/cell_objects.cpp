#include "common/runtime/cell_objects.hpp"

#include <algorithm>

#include "common/core/utf8.hpp"
#include "common/runtime/cell.hpp"
#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

constexpr const char* kKinds[] = {"mesh", "polyhedron", "primitive", "csg", "implicit"};
constexpr const char* kAllowedKinds = "mesh, polyhedron, primitive, csg, implicit";

/// Returns the one kind that the object has.
std::string kind_of(const ConfigReader& reader) {
  std::string found;
  for (const char* kind : kKinds) {
    if (!reader.has(kind)) continue;
    if (!found.empty())
      throw reader.error(kind, "stands beside " + found + "; allowed: one of " + kAllowedKinds);
    found = kind;
  }
  if (found.empty()) throw reader.error("mesh", std::string("is missing; allowed: one of ") + kAllowedKinds);
  return found;
}

void read_mesh(const ConfigReader& reader, ObjectConfig& object) {
  object.mesh = reader.path("mesh");
  if (reader.has("mesh_scale"))
    object.mesh_scale = reader.number("mesh_scale", {1e-6, 1e3, "m per mesh unit"});
  if (reader.has("up_axis")) object.y_up = reader.choice("up_axis", "z", {"z", "y"}) == "y";
  if (!std::filesystem::is_regular_file(object.mesh)) {
    throw reader.error("mesh", "is not a file (" + object.mesh.string() + ")");
  }
}

/// Reads flat lists: x, y, z per corner; three corner indices per triangle, from 0, counter-clockwise seen
/// from outside.
geometry::TriangleMesh read_polyhedron(const ConfigReader& shape, double scale) {
  const auto numbers = shape.numbers("vertices_m", {-1e4, 1e4, "m"});
  if (numbers.size() < 12 || numbers.size() % 3 != 0)
    throw shape.error("vertices_m", "needs x, y, z for each of at least 4 corners");
  const int corners = static_cast<int>(numbers.size() / 3);
  const auto indices = shape.integers("triangles", {0, corners - 1.0, "corners, from 0"});
  if (indices.size() < 12 || indices.size() % 3 != 0)
    throw shape.error("triangles", "needs three corners for each of at least 4 triangles");
  geometry::TriangleMesh mesh;
  for (std::size_t i = 0; i < numbers.size(); i += 3)
    mesh.vertices_m.push_back(
        (scale * Eigen::Vector3d(numbers[i], numbers[i + 1], numbers[i + 2])).cast<float>());
  const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(indices[i]); };
  for (std::size_t i = 0; i < indices.size(); i += 3)
    mesh.triangles.push_back({corner(i), corner(i + 1), corner(i + 2)});
  return mesh;
}

double read_scale(const ConfigReader& reader) { return reader.number("scale", 1.0, {1e-6, 1e6, ""}); }

geometry::ImplicitPtr read_scaled_solid(const ConfigReader& reader, const std::string& kind) {
  const ConfigReader shape = reader.section(kind);
  geometry::ImplicitPtr solid = kind == "implicit" ? read_formula_solid(shape) : read_solid(shape);
  const double scale = read_scale(reader);
  return scale == 1.0 ? solid : geometry::implicit_placed(std::move(solid), {}, scale);
}

}  // namespace

std::string read_name(const ConfigReader& reader) {
  constexpr std::size_t kLongest = 64;  // idl: string<64>
  const std::string name = reader.text("name");
  if (name.empty() || name.size() > kLongest) {
    throw reader.error(
        "name", "has " + std::to_string(name.size()) + " bytes; allowed: 1 to " + std::to_string(kLongest));
  }
  const bool shown =
      std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 32 || c == 127; });
  if (!shown || !core::is_utf8(name))
    throw ConfigError(reader.place() +
                      ": name: holds a character that cannot be shown; allowed: printable text");
  return name;
}

ObjectConfig read_object(const ConfigReader& reader, const workspace::LayerProfile& cell_profile,
                         double voxel_size_m) {
  ObjectConfig object;
  object.name = read_name(reader);
  object.place = reader.place();
  const std::string kind = kind_of(reader);
  if (kind == "mesh") {
    read_mesh(reader, object);
  } else if (kind == "polyhedron") {
    object.polyhedron_O = read_polyhedron(reader.section(kind), read_scale(reader));
  } else {
    object.solid_O = read_scaled_solid(reader, kind);
  }
  object.X_WO = reader.pose("pose");
  object.X_deviation = reader.pose("real_deviation");
  object.profile =
      reader.has("profile") ? read_profile(reader.section("profile"), voxel_size_m) : cell_profile;
  object.profile.guard_vox = reader.integer("guard_vox", object.profile.guard_vox, {0, 100, "voxels"});
  if (const auto checked = workspace::check_profile(object.profile); !checked)
    throw ConfigError(reader.place() + ": " + checked.message());
  object.priority = reader.integer("priority", 0, {-1'000'000, 1'000'000, ""});
  if (reader.has("colour")) {
    const auto rgb = reader.numbers("colour", {0, 1, ""});
    if (rgb.size() != 3) throw reader.error("colour", "needs three numbers, [red, green, blue], 0 to 1");
    for (std::size_t i = 0; i < 3; ++i) object.colour[i] = static_cast<float>(rgb[i]);
  }
  return object;
}

ObjectConfig read_object_text(const std::string& yaml, const CellConfig& cell) {
  const ConfigReader reader = ConfigReader::from_text(yaml, cell.file.string() + ": object");
  ObjectConfig object = read_object(reader, cell.profile, cell.voxel_size_m);
  reader.finish();
  return object;
}

}  // namespace phantom::runtime
