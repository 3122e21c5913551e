#include "common/workspace/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

int LayerProfile::reach_vox() const {
  return std::accumulate(thickness_vox.begin(), thickness_vox.end(), guard_vox);
}

int LayerProfile::inside_depth_vox() const {
  return std::accumulate(inside_thickness_vox.begin(), inside_thickness_vox.end(), 0);
}

namespace {

core::Status refuse(const std::string& what) {
  return core::Status::invalid_argument("layer profile: " + what);
}

std::string inner(std::size_t i) { return "layer -" + std::to_string(i + 1); }

core::Status check_inside(const LayerProfile& profile) {
  const auto& mu = profile.mu_inside_Pa_s_per_m;
  if (mu.size() != profile.inside_thickness_vox.size()) {
    return refuse(std::to_string(profile.inside_thickness_vox.size()) + " thicknesses for " +
                  std::to_string(mu.size()) + " viscosities inside the body; allowed: one per layer");
  }
  if (mu.size() > kMaxLayers) {
    return refuse(std::to_string(mu.size()) + " layers inside the body; allowed: at most " +
                  std::to_string(kMaxLayers));
  }
  long long depth = 0;
  for (const int thickness : profile.inside_thickness_vox) {
    if (thickness < 1)
      return refuse("a layer inside the body of " + std::to_string(thickness) +
                    " voxels; allowed: at least 1");
    depth += thickness;
  }
  if (depth > kMaxReach_vox) {
    return refuse("layers inside the body reach " + std::to_string(depth) +
                  " voxels deep; allowed: at most " + std::to_string(kMaxReach_vox));
  }
  for (std::size_t i = 0; i < mu.size(); ++i) {
    const float outer = i == 0 ? profile.mu_Pa_s_per_m.front() : mu[i - 1];
    if (!(std::isfinite(mu[i]) && mu[i] > outer)) {
      return refuse("viscosity does not rise inwards at " + inner(i) +
                    "; allowed: each layer more than the one nearer to the outside");
    }
  }
  if (!mu.empty() && mu.back() > profile.mu_skin_Pa_s_per_m) {
    return refuse("the viscosity of " + inner(mu.size() - 1) + " is above the skin's; allowed: at most that");
  }
  return core::Status::ok();
}

}  // namespace

core::Status check_profile(const LayerProfile& profile) {
  const auto& mu = profile.mu_Pa_s_per_m;
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
      return refuse("the viscosity of layer " + std::to_string(i + 1) + " is not a finite number above 0");
    if (i > 0 && mu[i] >= mu[i - 1]) {
      return refuse("viscosity does not fall outwards at layer " + std::to_string(i + 1) +
                    "; allowed: each layer less than the one nearer to the object");
    }
  }
  if (!(std::isfinite(profile.mu_skin_Pa_s_per_m) && profile.mu_skin_Pa_s_per_m >= mu.front())) {
    return refuse("the viscosity of the skin is below the first layer's; allowed: at least that");
  }
  return check_inside(profile);
}

core::Status check_palette(const std::vector<float>& palette_Pa_s_per_m) {
  const auto& palette = palette_Pa_s_per_m;
  if (palette.empty() || palette.size() > 256) {
    return core::Status::invalid_argument("palette: has " + std::to_string(palette.size()) +
                                          " values of viscosity; allowed: 1 to 256");
  }
  if (palette.front() != 0.0F)
    return core::Status::invalid_argument("palette: does not begin with 0, free space");
  for (std::size_t i = 1; i < palette.size(); ++i) {
    if (!std::isfinite(palette[i]) || palette[i] <= palette[i - 1]) {
      return core::Status::invalid_argument("palette: does not rise at code " + std::to_string(i));
    }
  }
  return core::Status::ok();
}

core::Expected<std::vector<float>> make_palette(const std::vector<LayerProfile>& profiles) {
  std::vector<float> palette{0.0F};
  for (const LayerProfile& profile : profiles) {
    palette.push_back(profile.mu_skin_Pa_s_per_m);
    palette.insert(palette.end(), profile.mu_Pa_s_per_m.begin(), profile.mu_Pa_s_per_m.end());
    palette.insert(palette.end(), profile.mu_inside_Pa_s_per_m.begin(), profile.mu_inside_Pa_s_per_m.end());
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
  const auto& inside = profile.mu_inside_Pa_s_per_m;
  for (std::size_t i = 0; i < inside.size(); ++i)
    codes[256 - (i + 1)] = code_of(inside[i]);  // the byte of −(i + 1)
  if (!inside.empty()) codes[kOrderBoundary] = code_of(inside.front());
  return codes;
}

}  // namespace phantom::workspace
