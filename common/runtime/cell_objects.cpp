#include "common/runtime/cell_objects.hpp"

#include "common/runtime/cell.hpp"
#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

constexpr const char* kKinds[] = {"mesh", "primitive", "csg", "implicit"};

/// Which of the kinds the object is.
std::string kind_of(const ConfigReader& reader) {
  std::string found;
  for (const char* kind : kKinds) {
    if (!reader.has(kind)) continue;
    if (!found.empty()) throw reader.error(kind, "stands beside " + found + "; allowed: one of mesh, primitive, csg, implicit");
    found = kind;
  }
  if (found.empty()) throw reader.error("mesh", "is missing; allowed: one of mesh, primitive, csg, implicit");
  return found;
}

void read_mesh(const ConfigReader& reader, ObjectConfig& object) {
  object.mesh = reader.path("mesh");
  if (reader.has("mesh_scale")) object.mesh_scale = reader.number("mesh_scale", {1e-6, 1e3, "m per mesh unit"});
  if (reader.has("up_axis")) object.y_up = reader.choice("up_axis", "z", {"z", "y"}) == "y";
  if (!std::filesystem::is_regular_file(object.mesh)) {
    throw reader.error("mesh", "is not a file (" + object.mesh.string() + ")");
  }
}

geometry::ImplicitPtr read_scaled_solid(const ConfigReader& reader, const std::string& kind) {
  const ConfigReader shape = reader.section(kind);
  geometry::ImplicitPtr solid = kind == "implicit" ? read_formula_solid(shape) : read_solid(shape);
  const double scale = reader.number("scale", 1.0, {1e-6, 1e6, ""});
  return scale == 1.0 ? solid : geometry::implicit_placed(std::move(solid), {}, scale);
}

}  // namespace

ObjectConfig read_object(const ConfigReader& reader, const voxel::LayerProfile& cell_profile, double voxel_size_m) {
  ObjectConfig object;
  object.name = reader.text("name");
  object.place = reader.place();
  const std::string kind = kind_of(reader);
  if (kind == "mesh") {
    read_mesh(reader, object);
  } else {
    object.solid_O = read_scaled_solid(reader, kind);
  }
  object.X_WO = reader.pose("pose");
  object.X_deviation = reader.pose("real_deviation");
  object.profile = reader.has("profile") ? read_profile(reader.section("profile"), voxel_size_m) : cell_profile;
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
