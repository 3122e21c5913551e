#include "common/voxel/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "common/voxel/palette.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {

int LayerProfile::reach_vox() const {
  return std::accumulate(thickness_vox.begin(), thickness_vox.end(), guard_vox);
}

core::Status check_profile(const LayerProfile& profile) {
  const auto& mu = profile.mu_Pa_s_per_m;
  const auto refuse = [](const std::string& what) {
    return core::Status::invalid_argument("layer profile: " + what);
  };
  if (mu.empty() || mu.size() > kMaxLayers) {
    return refuse(std::to_string(mu.size()) + " layers; allowed: 1 to " + std::to_string(kMaxLayers));
  }
  if (mu.size() != profile.thickness_vox.size()) {
    return refuse(std::to_string(profile.thickness_vox.size()) + " thicknesses for " +
                  std::to_string(mu.size()) + " viscosities; allowed: one per layer");
  }
  long long reach = profile.guard_vox;
  for (const int thickness : profile.thickness_vox) {
    if (thickness < 1)
      return refuse("a layer of " + std::to_string(thickness) + " voxels; allowed: at least 1");
    reach += thickness;
  }
  if (profile.guard_vox < 0)
    return refuse("a guard of " + std::to_string(profile.guard_vox) + " voxels; allowed: from 0");
  if (reach > kMaxReach_vox) {
    return refuse("layers and guard reach " + std::to_string(reach) + " voxels; allowed: at most " +
                  std::to_string(kMaxReach_vox));
  }
  for (std::size_t i = 0; i < mu.size(); ++i) {
    if (!(std::isfinite(mu[i]) && mu[i] > 0))
      return refuse("the viscosity of layer " + std::to_string(i + 1) + " is not above 0");
    if (i > 0 && mu[i] >= mu[i - 1]) {
      return refuse("viscosity does not fall outwards at layer " + std::to_string(i + 1) +
                    "; allowed: each layer less than the one nearer to the object");
    }
  }
  if (!(std::isfinite(profile.mu_skin_Pa_s_per_m) && profile.mu_skin_Pa_s_per_m >= mu.front())) {
    return refuse("the viscosity of the skin is below the first layer's; allowed: at least that");
  }
  return core::Status::ok();
}

core::Expected<std::vector<float>> make_palette(const std::vector<LayerProfile>& profiles) {
  std::vector<float> palette{0.0F};
  for (const LayerProfile& profile : profiles) {
    palette.push_back(profile.mu_skin_Pa_s_per_m);
    palette.insert(palette.end(), profile.mu_Pa_s_per_m.begin(), profile.mu_Pa_s_per_m.end());
  }
  std::sort(palette.begin(), palette.end());
  palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
  if (core::Status checked = check_palette(palette); !checked) return checked;
  return palette;
}

CodeTable code_table(const LayerProfile& profile, const std::vector<float>& palette_Pa_s_per_m) {
  const auto code_of = [&](float mu) {
    const auto place = std::lower_bound(palette_Pa_s_per_m.begin(), palette_Pa_s_per_m.end(), mu);
    return static_cast<std::uint8_t>(place - palette_Pa_s_per_m.begin());
  };
  CodeTable codes{};
  for (std::size_t i = 0; i < profile.mu_Pa_s_per_m.size(); ++i)
    codes[i + 1] = code_of(profile.mu_Pa_s_per_m[i]);
  codes[kOrderGuard] = code_of(profile.mu_Pa_s_per_m.front());
  codes[kOrderBoundary] = codes[kOrderInterior] = code_of(profile.mu_skin_Pa_s_per_m);
  return codes;
}

}  // namespace phantom::voxel
