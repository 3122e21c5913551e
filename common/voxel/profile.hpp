#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/core/status.hpp"

namespace phantom::voxel {

/// Greatest reach of a profile, in voxels: its square must fit 16 bits.
inline constexpr int kMaxReach_vox = 254;
/// Greatest number of layers: orders 1…98 (99 is the guard).
inline constexpr int kMaxLayers = 98;

/// Graded fluid around an object (spec 1.4, 1.5).
struct LayerProfile {
  std::vector<int> thickness_vox;     ///< m_i per layer, ≥ 1; layer 1 is the nearest
  std::vector<float> mu_Pa_s_per_m;   ///< per layer, > 0, falling outwards; same length
  float mu_skin_Pa_s_per_m = 100.0F;  ///< boundary and interior; ≥ the first layer's
  int guard_vox =
      0;  ///< j: a protective skin wrapped on the solid, with the μ of layer 1; the layers begin outside it

  /// Distance in voxels up to which the object changes the space around it: guard + Σm_i.
  int reach_vox() const;
};

/// Whether the profile can be used; the message says what is wrong and what is allowed.
core::Status check_profile(const LayerProfile& profile);

/// Palette of a workspace: 0 and every μ that the profiles name, rising. Refuses more than 256 different
/// values.
core::Expected<std::vector<float>> make_palette(const std::vector<LayerProfile>& profiles);

/// μ code by neighbour order (index: the order's byte). Every μ of the profile must stand in the palette.
using CodeTable = std::array<std::uint8_t, 256>;
CodeTable code_table(const LayerProfile& profile, const std::vector<float>& palette_Pa_s_per_m);

}  // namespace phantom::voxel
