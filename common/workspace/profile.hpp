#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/core/status.hpp"

namespace phantom::workspace {

/// Greatest reach of a profile, in voxels: its square must fit 16 bits.
inline constexpr int kMaxReach_vox = 254;
/// Greatest number of layers: orders 1…98 (99 is the guard).
inline constexpr int kMaxLayers = 98;

/// How the layers are computed (spec 1.4).
enum class LayerMethod : std::uint8_t {
  kDistance,  ///< exact Euclidean distance between voxel centres
  kSurface,   ///< distance from a voxel's centre to the mesh's true surface
  kDilation   ///< the thesis's method: a shaping element centred on every voxel of the previous layer
};

/// Shaping element of the dilation method, in a cube of (2m+1)³ voxels.
enum class ShapingElement : std::uint8_t {
  kCube,
  kSphere,          ///< i² + j² + k² ≤ m²
  kSphereContained  ///< i² + j² + k² ≤ (m + ½)²
};

/// Graded fluid around an object (spec 1.4, 1.5).
struct LayerProfile {
  std::vector<int> thickness_vox;     ///< m_i per layer, ≥ 1; layer 1 is the nearest
  std::vector<float> mu_Pa_s_per_m;   ///< per layer, > 0, falling outwards; same length
  float mu_skin_Pa_s_per_m = 100.0F;  ///< μ of boundary and interior; ≥ the first layer's
  int guard_vox = 0;  ///< j: thickness of the guard around the solid, which has the μ of layer 1; the layers
                      ///< begin outside it
  LayerMethod method = LayerMethod::kDistance;
  ShapingElement element = ShapingElement::kSphere;  ///< used by kDilation only

  /// Layers inside the body, from order −1 (touching the boundary) to −n. Deeper voxels have mu_skin. If
  /// there are such layers, the boundary has the μ of order −1, so that a model larger than the real object
  /// still gives a continuous percept.
  std::vector<int> inside_thickness_vox;
  std::vector<float> mu_inside_Pa_s_per_m;  ///< rising inwards, from above layer 1's to at most mu_skin

  /// Of a soft body: by how much the pressure on what presses in rises per metre of depth, in each of these
  /// layers, ≥ 0. Empty: the body is not soft.
  std::vector<double> stiffness_inside_Pa_per_m;

  /// Returns how far, in voxels, the object changes the space around it: guard + Σm_i.
  int reach_vox() const;
  /// Returns how deep, in voxels, the layers inside the body reach.
  int inside_depth_vox() const;
};

/// Checks the profile. The message of an error says what is wrong and what is allowed.
core::Status check_profile(const LayerProfile& profile);

/// Checks whether `palette_Pa_s_per_m` can be a workspace's palette: 1 to 256 finite entries, the first 0,
/// strictly rising.
core::Status check_palette(const std::vector<float>& palette_Pa_s_per_m);
/// Returns a workspace's palette: 0 and every μ of the profiles, rising. Refuses more than 256 different
/// values.
core::Expected<std::vector<float>> make_palette(const std::vector<LayerProfile>& profiles);

/// A palette in succession of another one.
struct NextPalette {
  std::vector<float> mu_Pa_s_per_m;
  bool keeps_codes = true;  ///< every μ of the profiles that the present palette holds has its code still
};
/// Returns a palette that holds every μ of the profiles, and keeps the codes of the present one where it can:
/// a new μ takes a free code between those of its neighbours. Where there is none, all codes are given anew,
/// with free ones between them as long as that costs no time at sensing. At a free code stands a μ that no
/// profile has. Refuses more than 256 different values.
core::Expected<NextPalette> next_palette(const std::vector<LayerProfile>& profiles,
                                         const std::vector<float>& present_Pa_s_per_m);

/// Maps a neighbour order (index: the order's byte) to a μ code. The palette must contain every μ of the
/// profile.
using CodeTable = std::array<std::uint8_t, 256>;
CodeTable code_table(const LayerProfile& profile, const std::vector<float>& palette_Pa_s_per_m);

}  // namespace phantom::workspace
