#include "common/runtime/cell/cell.hpp"

#include <set>

#include "common/core/text.hpp"
#include "common/runtime/cell/cell_parts.hpp"
#include "common/runtime/configuration/named.hpp"

namespace phantom::runtime {
namespace {

template <class Items>
void refuse_duplicates(const Fields& file, const std::string& key, const Items& items) {
  std::set<std::string> names;
  for (const auto& item : items)
    file.check(names.insert(item.name).second, key, "has two entries called '" + item.name + "'");
}

void read_workspace(const Fields& workspace, CellConfig& cell) {
  workspace.vector3("min_m", cell.min_m);
  workspace.vector3("max_m", cell.max_m);
  Eigen::Vector3d sides_m = cell.voxel_size_m.sides_m();
  workspace.axes("voxel_size_m", sides_m);
  cell.voxel_size_m = workspace::VoxelSize(sides_m);
  const core::Status checked = workspace::check_voxel_size(cell.voxel_size_m);
  workspace.check(checked.is_ok(), "voxel_size_m", checked.message());
  using enum layers::MergeLaw;
  workspace.choice("merge", cell.merge,
                   {{"highest_viscosity", kHighestViscosity},
                    {"latest_object", kLatestObject},
                    {"object_priority", kObjectPriority}});
  for (int axis = 0; axis < 3; ++axis) {
    const double voxels = (cell.max_m[axis] - cell.min_m[axis]) / cell.voxel_size_m.sides_m()[axis];
    workspace.check(voxels >= 1 && voxels <= 8192, "max_m",
                    "gives " + std::to_string(static_cast<long long>(voxels)) + " voxels along axis " +
                        std::to_string(axis) + "; allowed: 1 to 8192");
  }
}

MediumConfig read_medium(const Fields& fields) {
  MediumConfig medium;
  medium.name = read_name(fields);
  fields.number("mu_Pa_s_per_m", medium.mu_Pa_s_per_m);
  fields.vector3("min_m", medium.min_m);
  fields.vector3("max_m", medium.max_m);
  fields.check((medium.min_m.array() < medium.max_m.array()).all(), "max_m",
               "is not greater than min_m along each axis; allowed: a box");
  fields.vector3("current_m_s", medium.current_m_s);
  if (fields.has("density_kg_per_m3")) medium.density_kg_per_m3 = fields.value("density_kg_per_m3");
  return medium;
}

}  // namespace

const FieldTable& cell_table() {
  static const FieldTable table{kCellKeys, kArmKeys};
  return table;
}

const ArmConfig& CellConfig::arm(const std::string& arm_name) const {
  if (arm_name.empty() && arms.size() == 1) return arms.front();
  if (arm_name.empty())
    throw core::ConfigError(file.string() + ": arms: there are " + std::to_string(arms.size()) +
                            ", so one must be named, by --arm or the key `arm`; allowed: " +
                            core::listed(arms, &ArmConfig::name));
  return find_named(arms, arm_name, file.string() + ": arms: no arm called '" + arm_name + "'");
}

CellConfig load_cell(const std::filesystem::path& path, CellArms arms) {
  const Fields file = Fields(path, cell_table()).as("cell");
  CellConfig cell;
  cell.file = path;
  cell.name = read_name(file);
  read_workspace(file.section("workspace"), cell);
  cell.profile = read_profile(file.section("profile").as("profile"), cell.voxel_size_m);
  for (const Fields& object : file.sections("objects")) {
    cell.objects.push_back(read_object(object.as("object"), cell.profile, cell.voxel_size_m));
    cell.objects.back().id = static_cast<std::uint16_t>(cell.objects.size());
  }
  for (const Fields& medium : file.sections("media")) cell.media.push_back(read_medium(medium.as("medium")));
  for (const Fields& arm : file.sections("arms"))
    cell.arms.push_back(read_mounted_arm(arm.as("mounted_arm")));
  file.check(cell.objects.size() <= 65534, "objects", "has too many entries; allowed: at most 65534");
  file.check(arms == CellArms::kOptional || !cell.arms.empty(), "arms",
             "is empty; allowed: at least one arm");
  refuse_duplicates(file, "objects", cell.objects);
  refuse_duplicates(file, "media", cell.media);
  refuse_duplicates(file, "arms", cell.arms);
  file.finish();
  return cell;
}

}  // namespace phantom::runtime
