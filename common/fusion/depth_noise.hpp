#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/fusion/camera_scene.hpp"

namespace phantom::fusion {

/// Errors of a simulated depth camera (structured light or stereo).
struct DepthNoise {
  DepthSigma sigma;                 ///< of white noise: grows with the depth's square
  double quantum_at_1m_m = 0.0005;  ///< step of the disparity, as a depth at 1 m; grows with the square, too
  double dropout = 0.002;           ///< share of pixels without a measurement
  double edge_jump_m = 0.02;        ///< neighbours that differ by more are an edge
  double edge_dropout = 0.3;        ///< share of the pixels at an edge without a measurement
  double flying = 0.5;  ///< share of the pixels at an edge, measured, that lie between the two surfaces
  double steel_dropout = 0.3;    ///< share of patches of a specular surface without a measurement
  double steel_mirrored = 0.05;  ///< share of such patches that measure what they mirror
  double glare_cos = 0.98;       ///< a specular surface seen more directly than this blinds the sensor
  double grazing_cos = 0.25;     ///< one seen more obliquely than this sends nothing back
  int steel_patch_px = 4;        ///< edge of the patches
};

/// Checks that shares are 0…1, lengths finite and not negative. The error names the value.
core::Status check_noise(const DepthNoise& noise);

/// Measures depths in millimetres of what a camera sees, with errors. The same seed and frame number give the
/// same errors; patches of steel change every 8 frames. `seen` and `depth_mm` have the camera's pixels.
/// Allocates nothing.
void measure_depth(const PinholeCamera& camera, std::span<const SeenPixel> seen, const DepthNoise& noise,
                   std::uint64_t seed, std::uint64_t frame, std::span<std::uint16_t> depth_mm);

}  // namespace phantom::fusion
