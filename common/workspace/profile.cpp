#include "common/workspace/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
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

core::Status check_stiffness(const LayerProfile& profile) {
  const auto& stiffness = profile.stiffness_inside_Pa_per_m;
  if (!stiffness.empty() && stiffness.size() != profile.inside_thickness_vox.size()) {
    return refuse(std::to_string(stiffness.size()) + " stiffnesses for " +
                  std::to_string(profile.inside_thickness_vox.size()) +
                  " layers inside the body; allowed: one per layer, or none");
  }
  if (!std::all_of(stiffness.begin(), stiffness.end(), [](double k) { return std::isfinite(k) && k >= 0.0; }))
    return refuse("a layer's stiffness is below 0 or not finite; allowed: 0 Pa/m and more");
  return core::Status::ok();
}

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
  if (const core::Status inside = check_inside(profile); !inside) return inside;
  return check_stiffness(profile);
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

namespace {

struct PlacedMu {
  std::size_t code;
  float mu;
};

/// Gives codes to rising values. Those in `present` keep theirs; others come between, `gap` apart at the end.
/// Returns nothing if there is no room for them.
std::optional<std::vector<PlacedMu>> placed(const std::vector<float>& values,
                                            const std::vector<float>& present, std::size_t gap) {
  std::vector<PlacedMu> codes{{0, 0.0F}};
  std::vector<float> fresh;
  const auto place_fresh = [&](std::size_t end) {
    const std::size_t from = codes.back().code, step = (end - from) / (fresh.size() + 1);
    if (step == 0) return false;
    for (std::size_t k = 0; k < fresh.size(); ++k) codes.push_back({from + step * (k + 1), fresh[k]});
    fresh.clear();
    return true;
  };
  for (const float mu : values) {
    const auto at = std::lower_bound(present.begin(), present.end(), mu);
    if (at == present.end() || *at != mu) {
      fresh.push_back(mu);
      continue;
    }
    const auto code = static_cast<std::size_t>(at - present.begin());
    if (!place_fresh(code)) return std::nullopt;
    codes.push_back({code, mu});
  }
  if (!place_fresh(std::min<std::size_t>(256, codes.back().code + gap * (fresh.size() + 1))))
    return std::nullopt;
  return codes;
}

/// Returns the palette with these codes; free ones between them get values in between.
std::vector<float> filled(const std::vector<PlacedMu>& codes) {
  std::vector<float> palette{0.0F};
  for (std::size_t i = 1; i < codes.size(); ++i) {
    const PlacedMu &low = codes[i - 1], &high = codes[i];
    const auto steps = static_cast<float>(high.code - low.code);
    for (std::size_t k = 1; low.code + k < high.code; ++k)
      palette.push_back(low.mu + (high.mu - low.mu) * (static_cast<float>(k) / steps));
    palette.push_back(high.mu);
  }
  return palette;
}

}  // namespace

core::Expected<NextPalette> next_palette(const std::vector<LayerProfile>& profiles,
                                         const std::vector<float>& present_Pa_s_per_m) {
  auto tight = make_palette(profiles);
  if (!tight) return tight.status();
  const std::vector<float> values(tight->begin() + 1, tight->end());
  if (std::includes(present_Pa_s_per_m.begin(), present_Pa_s_per_m.end(), values.begin(), values.end()))
    return NextPalette{present_Pa_s_per_m, true};
  // Up to 32 codes the kernels are at their fastest (ClusterStencil::kMaxCounted).
  const std::size_t gap = std::max<std::size_t>(std::max<std::size_t>(1, 32 / (values.size() + 1)),
                                                std::min<std::size_t>(2, 256 / (values.size() + 1)));
  for (const bool keeps_codes : {true, false}) {
    const auto codes = placed(values, keeps_codes ? present_Pa_s_per_m : std::vector<float>{0.0F}, gap);
    if (!codes) continue;
    NextPalette next{filled(*codes), keeps_codes};
    if (check_palette(next.mu_Pa_s_per_m)) return next;  // unless values lie too close together for floats
  }
  return NextPalette{*std::move(tight), false};
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
