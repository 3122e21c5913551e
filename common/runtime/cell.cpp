#include "common/runtime/cell.hpp"

#include <set>

#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

template <class Items>
void refuse_duplicates(const ConfigReader& file, const std::string& key, const Items& items) {
  std::set<std::string> names;
  for (const auto& item : items) {
    if (!names.insert(item.name).second) throw file.error(key, "has two entries called '" + item.name + "'");
  }
}

layers::MergeLaw read_merge_law(const ConfigReader& workspace) {
  const std::string law = workspace.choice("merge", "highest_viscosity",
                                           {"highest_viscosity", "latest_object", "object_priority"});
  if (law == "latest_object") return layers::MergeLaw::kLatestObject;
  return law == "object_priority" ? layers::MergeLaw::kObjectPriority : layers::MergeLaw::kHighestViscosity;
}

}  // namespace

const ArmConfig& CellConfig::arm(const std::string& arm_name) const {
  if (arm_name.empty() && arms.size() == 1) return arms.front();
  std::string known;
  for (const auto& candidate : arms) {
    if (candidate.name == arm_name) return candidate;
    known += (known.empty() ? "" : ", ") + candidate.name;
  }
  throw ConfigError(file.string() + ": arms: no arm called '" + arm_name + "'; allowed: " + known);
}

CellConfig load_cell(const std::filesystem::path& path, CellArms arms) {
  const ConfigReader file = ConfigReader::from_file(path);
  CellConfig cell;
  cell.file = path;
  cell.name = read_name(file);
  const ConfigReader workspace = file.section("workspace");
  cell.min_m = workspace.vector3("min_m");
  cell.max_m = workspace.vector3("max_m");
  cell.voxel_size_m = workspace.number("voxel_size_m", {0.0001, 1.0, "m"});
  cell.merge = read_merge_law(workspace);
  for (int axis = 0; axis < 3; ++axis) {
    const double voxels = (cell.max_m[axis] - cell.min_m[axis]) / cell.voxel_size_m;
    if (voxels < 1 || voxels > 8192) {
      throw workspace.error("max_m", "gives " + std::to_string(static_cast<long long>(voxels)) +
                                         " voxels along axis " + std::to_string(axis) +
                                         "; allowed: 1 to 8192");
    }
  }
  cell.profile = read_profile(file.section("profile"), cell.voxel_size_m);
  for (const auto& object : file.sections("objects")) {
    cell.objects.push_back(read_object(object, cell.profile, cell.voxel_size_m));
    cell.objects.back().id = static_cast<std::uint16_t>(cell.objects.size());
  }
  for (const auto& arm : file.sections("arms")) cell.arms.push_back(read_arm(arm));
  if (cell.objects.size() > 65534)
    throw file.error("objects", "has too many entries; allowed: at most 65534");
  if (arms == CellArms::kNeeded && cell.arms.empty())
    throw file.error("arms", "is empty; allowed: at least one arm");
  refuse_duplicates(file, "objects", cell.objects);
  refuse_duplicates(file, "arms", cell.arms);
  file.finish();
  return cell;
}

}  // namespace phantom::runtime
