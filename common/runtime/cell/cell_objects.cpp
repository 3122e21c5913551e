#include "common/runtime/cell/cell_objects.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/utf8.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_parts.hpp"

namespace phantom::runtime {
namespace {

/// Reads flat lists: x, y, z per corner; three corner indices per triangle.
geometry::TriangleMesh read_polyhedron(const Fields& shape, double scale) {
  std::vector<double> m;
  shape.numbers("vertices_m", m);
  shape.check(m.size() >= 12 && m.size() % 3 == 0, "vertices_m",
              "needs x, y, z for each of at least 4 corners");
  std::vector<int> corner;
  shape.numbers("triangles", corner);
  shape.check(corner.size() >= 12 && corner.size() % 3 == 0, "triangles",
              "needs three corners for each of at least 4 triangles");
  const auto last = static_cast<int>(m.size() / 3) - 1;
  shape.check(*std::ranges::max_element(corner) <= last, "triangles",
              "names a corner that is not there; allowed: 0 to " + std::to_string(last));
  geometry::TriangleMesh mesh;
  for (std::size_t i = 0; i < m.size(); i += 3)
    mesh.vertices_m.push_back((scale * Eigen::Vector3d(m[i], m[i + 1], m[i + 2])).cast<float>());
  for (auto c = corner.begin(); c != corner.end(); c += 3)
    mesh.triangles.push_back({static_cast<std::uint32_t>(c[0]), static_cast<std::uint32_t>(c[1]),
                              static_cast<std::uint32_t>(c[2])});
  return mesh;
}

void read_body(const Fields& fields, ObjectConfig& object) {
  const std::string kind = fields.one_of("mesh", "body");
  if (kind == "mesh") {
    object.mesh = fields.existing_file("mesh");
    fields.number("mesh_scale", object.mesh_scale);
    fields.choice("up_axis", object.y_up, {{"z", false}, {"y", true}});
    return;
  }
  const double scale = fields.value("scale", 1.0);
  const Fields shape = fields.section(kind);
  if (kind == "polyhedron") {
    object.polyhedron_O = read_polyhedron(shape, scale);
    return;
  }
  object.solid_O =
      kind == "implicit" ? read_formula_solid(shape.as("shape.implicit")) : read_shape(shape.as("shape"));
  if (scale != 1.0) object.solid_O = geometry::implicit_placed(std::move(object.solid_O), {}, scale);
}

/// Checks an object that is no body: nothing may be stated of it that only a body has. Layers inside, which
/// it may have from the cell's profile, are left out.
void make_zone(const Fields& fields, ObjectConfig& object) {
  for (const char* key : {"real_deviation", "mass_kg", "max_contact_force_N", "loose", "hold"})
    fields.check(!fields.has(key), key,
                 "does not go with kind: protected_zone, which is no body; allowed: without it");
  if (fields.has("profile"))
    fields.check(object.profile.inside_thickness_vox.empty(), "profile",
                 "has layers inside the body, which a protected_zone is not; allowed: without inside");
  object.profile.inside_thickness_vox.clear();
  object.profile.mu_inside_Pa_s_per_m.clear();
  object.profile.stiffness_inside_Pa_per_m.clear();
}

}  // namespace

int guard_for(double pose_error_m, const workspace::VoxelSize& size) {
  constexpr double kExact = 1e-9;  // a whole number of voxels is that number
  return static_cast<int>(std::ceil(pose_error_m / size.reference_m() - kExact));
}

std::string read_name(const Fields& fields) {
  std::string name = fields.text("name");
  const bool shown = std::ranges::none_of(name, [](unsigned char c) { return c < 32 || c == 127; });
  if (!shown || !core::is_utf8(name))
    throw ConfigError(fields.place() +
                      ": name: holds a character that cannot be shown; allowed: printable text");
  return name;
}

ObjectConfig read_object(const Fields& fields, const workspace::LayerProfile& cell_profile,
                         const workspace::VoxelSize& size) {
  ObjectConfig object;
  object.name = read_name(fields);
  object.place = fields.place();
  fields.choice("kind", object.kind,
                {{"solid", ObjectKind::kSolid}, {"protected_zone", ObjectKind::kProtectedZone}});
  read_body(fields, object);
  object.X_WO = fields.pose("pose");
  object.X_deviation = fields.pose("real_deviation");
  object.profile =
      fields.has("profile") ? read_profile(fields.section("profile").as("profile"), size) : cell_profile;
  fields.number("guard_vox", object.profile.guard_vox);
  fields.number("pose_error_m", object.pose_error_m);
  object.profile.guard_vox = std::max(object.profile.guard_vox, guard_for(object.pose_error_m, size));
  if (object.is_zone()) make_zone(fields, object);
  check_in_voxels(fields, object.profile, size);
  fields.number("priority", object.priority);
  fields.number("mass_kg", object.mass_kg);
  fields.number("max_contact_force_N", object.max_contact_force_N);
  fields.flag("loose", object.loose);
  fields.check(!object.loose || object.mass_kg > 0.0, "loose", "needs mass_kg; allowed: with it, above 0");
  if (fields.has("hold")) {
    const Fields hold = fields.section("hold");
    object.hold = HoldConfig{hold.text("arm"), hold.text("frame"), hold.pose("pose")};
    fields.check(!object.loose || object.hold->arm.empty(), "loose",
                 "does not go with hold, of what an arm carries from the start; allowed: one of them");
  }
  std::vector<double> rgb;
  fields.numbers("colour", rgb);
  if (!fields.has("colour")) return object;
  fields.check(rgb.size() == 3, "colour", "needs three numbers, [red, green, blue], 0 to 1");
  std::ranges::transform(rgb, object.colour.begin(), [](double c) { return static_cast<float>(c); });
  return object;
}

ObjectConfig read_object_text(const std::string& yaml, const CellConfig& cell) {
  const Fields fields = Fields::from_text(yaml, cell.file.string() + ": object", cell_table()).as("object");
  ObjectConfig object = read_object(fields, cell.profile, cell.voxel_size_m);
  fields.finish();
  return object;
}

}  // namespace phantom::runtime
