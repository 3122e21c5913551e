#include "common/runtime/cell.hpp"

#include <numbers>
#include <set>

#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

LayerProfileConfig read_profile(const ConfigReader& reader) {
  LayerProfileConfig profile;
  profile.thickness_vox = reader.integers("thickness_vox", {1, 1000, "voxels"});
  profile.mu_Pa_s_per_m = reader.numbers("mu_Pa_s_per_m", {1e-6, 1e6, "Pa·s/m"});
  profile.mu_skin_Pa_s_per_m = reader.number("mu_skin_Pa_s_per_m", 100.0, {1e-6, 1e6, "Pa·s/m"});
  profile.guard_vox = reader.integer("guard_vox", 0, {0, 100, "voxels"});
  const auto& mu = profile.mu_Pa_s_per_m;
  if (mu.empty() || mu.size() > 100) throw reader.error("mu_Pa_s_per_m", "needs 1 to 100 layers");
  if (mu.size() != profile.thickness_vox.size()) {
    throw reader.error("mu_Pa_s_per_m", "has " + std::to_string(mu.size()) + " layers, thickness_vox has " +
                                            std::to_string(profile.thickness_vox.size()) +
                                            "; allowed: the same number");
  }
  for (std::size_t i = 1; i < mu.size(); ++i) {
    if (mu[i] >= mu[i - 1]) {
      throw reader.error("mu_Pa_s_per_m", "does not fall outwards at layer " + std::to_string(i + 1) +
                                              "; allowed: each layer less than the one nearer to the object");
    }
  }
  if (profile.mu_skin_Pa_s_per_m < mu.front()) {
    throw reader.error("mu_skin_Pa_s_per_m", "is below the first layer's; allowed: at least that");
  }
  return profile;
}

ObjectConfig read_object(const ConfigReader& reader, const LayerProfileConfig& cell_profile) {
  ObjectConfig object;
  object.name = reader.text("name");
  object.mesh = reader.path("mesh");
  object.mesh_scale = reader.number("mesh_scale", 1.0, {1e-6, 1e3, "m per mesh unit"});
  object.y_up = reader.choice("up_axis", "z", {"z", "y"}) == "y";
  object.X_WO = reader.pose("pose");
  object.X_deviation = reader.pose("real_deviation");
  object.profile = reader.has("profile") ? read_profile(reader.section("profile")) : cell_profile;
  if (reader.has("colour")) {
    const auto rgb = reader.numbers("colour", {0, 1, ""});
    if (rgb.size() != 3) throw reader.error("colour", "needs three numbers, [red, green, blue], 0 to 1");
    for (std::size_t i = 0; i < 3; ++i) object.colour[i] = static_cast<float>(rgb[i]);
  }
  if (!std::filesystem::is_regular_file(object.mesh)) {
    throw reader.error("mesh", "is not a file (" + object.mesh.string() + ")");
  }
  return object;
}

std::optional<int> read_auto_count(const ConfigReader& reader, const char* key, Range range) {
  if (!reader.has(key) || reader.text(key) == "auto") return std::nullopt;
  return reader.integer(key, range);
}

SkinSegmentConfig read_segment(const ConfigReader& reader) {
  SkinSegmentConfig segment;
  segment.from_m = reader.vector3("from_m");
  segment.to_m = reader.vector3("to_m");
  segment.from_radius_m = reader.number("from_radius_m", {0, 10, "m"});
  segment.to_radius_m = reader.number("to_radius_m", segment.from_radius_m, {0, 10, "m"});
  segment.sides = read_auto_count(reader, "sides", {3, 10000, "sensors"});
  segment.rings = read_auto_count(reader, "rings", {2, 10000, "rings"});
  segment.spin_rad = reader.number("spin_deg", 0.0, {-360, 360, "degrees"}) * kDegree;
  segment.gain = reader.number("gain", 1.0, {0, 1000, ""});
  if ((segment.to_m - segment.from_m).norm() < 1e-6)
    throw reader.error("to_m", "is the same point as from_m");
  return segment;
}

ArmConfig read_arm(const ConfigReader& reader) {
  ArmConfig arm;
  arm.name = reader.text("name");
  arm.urdf = reader.path("urdf");
  arm.tip_link = reader.text("tip_link");
  arm.X_WB = reader.pose("mount");
  arm.home = reader.numbers("home");
  if (!std::filesystem::is_regular_file(arm.urdf))
    throw reader.error("urdf", "is not a file (" + arm.urdf.string() + ")");
  for (const auto& link : reader.sections("skin")) {
    LinkSkinConfig skin{link.text("link"), {}};
    for (const auto& segment : link.sections("segments")) skin.segments.push_back(read_segment(segment));
    if (skin.segments.empty()) throw link.error("segments", "is empty; allowed: at least one segment");
    arm.skin.push_back(std::move(skin));
  }
  for (const auto& point : reader.sections("interest_points")) {
    arm.interest_points.push_back({point.text("name"), point.text("link"), point.vector3("position_m")});
  }
  return arm;
}

template <class Items>
void refuse_duplicates(const ConfigReader& file, const std::string& key, const Items& items) {
  std::set<std::string> names;
  for (const auto& item : items) {
    if (!names.insert(item.name).second) throw file.error(key, "has two entries called '" + item.name + "'");
  }
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

CellConfig load_cell(const std::filesystem::path& path) {
  const ConfigReader file = ConfigReader::from_file(path);
  CellConfig cell;
  cell.file = path;
  cell.name = file.text("name");
  const ConfigReader workspace = file.section("workspace");
  cell.min_m = workspace.vector3("min_m");
  cell.max_m = workspace.vector3("max_m");
  cell.voxel_size_m = workspace.number("voxel_size_m", {0.0001, 1.0, "m"});
  for (int axis = 0; axis < 3; ++axis) {
    const double voxels = (cell.max_m[axis] - cell.min_m[axis]) / cell.voxel_size_m;
    if (voxels < 1 || voxels > 8192) {
      throw workspace.error("max_m", "gives " + std::to_string(static_cast<long long>(voxels)) +
                                         " voxels along axis " + std::to_string(axis) +
                                         "; allowed: 1 to 8192");
    }
  }
  const LayerProfileConfig profile = read_profile(file.section("profile"));
  for (const auto& object : file.sections("objects")) cell.objects.push_back(read_object(object, profile));
  for (const auto& arm : file.sections("arms")) cell.arms.push_back(read_arm(arm));
  if (cell.objects.size() > 65534)
    throw file.error("objects", "has too many entries; allowed: at most 65534");
  if (cell.arms.empty()) throw file.error("arms", "is empty; allowed: at least one arm");
  refuse_duplicates(file, "objects", cell.objects);
  refuse_duplicates(file, "arms", cell.arms);
  file.finish();
  return cell;
}

}  // namespace phantom::runtime
