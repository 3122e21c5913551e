#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {

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

}  // namespace phantom::runtime
