#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {

voxel::LayerProfile read_profile(const ConfigReader& reader, [[maybe_unused]] double voxel_size_m) {
  voxel::LayerProfile profile;
  profile.thickness_vox = reader.integers("thickness_vox", {1, 1000, "voxels"});
  const auto mu = reader.numbers("mu_Pa_s_per_m", {1e-6, 1e6, "Pa·s/m"});
  profile.mu_Pa_s_per_m.assign(mu.begin(), mu.end());
  profile.mu_skin_Pa_s_per_m = static_cast<float>(reader.number("mu_skin_Pa_s_per_m", 100.0, {1e-6, 1e6, "Pa·s/m"}));
  profile.guard_vox = reader.integer("guard_vox", 0, {0, 100, "voxels"});
  if (mu.size() != profile.thickness_vox.size()) {
    throw reader.error("mu_Pa_s_per_m", "has " + std::to_string(mu.size()) + " layers, thickness_vox has " +
                                            std::to_string(profile.thickness_vox.size()) +
                                            "; allowed: the same number");
  }
  if (const auto checked = voxel::check_profile(profile); !checked)
    throw ConfigError(reader.place() + ": " + checked.message());
  return profile;
}

}  // namespace phantom::runtime
