#include "common/fusion/depth_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/text.hpp"

namespace phantom::fusion {
namespace {

/// Random numbers of one pixel of one frame (splitmix64): they depend on nothing else.
class PixelDice {
 public:
  PixelDice(std::uint64_t seed, std::uint64_t frame, std::uint64_t pixel)
      : state_(mixed(mixed(mixed(seed) + frame) + pixel)) {}

  /// Returns the next number, uniform in [0, 1).
  double uniform() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return static_cast<double>(mixed(state_) >> 11) * 0x1p-53;
  }
  /// Returns the next number, normal with variance 1 (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ z >> 27) * 0x94d049bb133111ebULL;
    return z ^ z >> 31;
  }
  std::uint64_t state_;
};

constexpr std::uint64_t kPatchFrames = 8, kPatches = std::uint64_t{1} << 40;

class Sensor {
 public:
  Sensor(const PinholeCamera& camera, std::span<const SeenPixel> seen, const DepthNoise& noise,
         std::uint64_t seed, std::uint64_t frame)
      : camera_(camera), seen_(seen), noise_(noise), seed_(seed), frame_(frame) {}

  std::uint16_t measured_mm(int u, int v) const {
    const SeenPixel& pixel = at(u, v);
    if (pixel.depth_m <= 0.0F) return 0;
    PixelDice dice(seed_, frame_, number(u, v));
    if (dice.uniform() < noise_.dropout) return 0;
    double depth_m = static_cast<double>(pixel.depth_m);
    if (pixel.specular) depth_m = steel_depth_m(pixel, u, v);
    if (depth_m <= 0.0) return 0;
    if (const double other_m = across_edge_m(u, v); other_m > 0.0) {
      if (dice.uniform() < noise_.edge_dropout) return 0;
      if (dice.uniform() < noise_.flying) depth_m += dice.uniform() * (other_m - depth_m);
    }
    depth_m += noise_.sigma.at(depth_m) * dice.normal();
    return millimetres(quantised_m(depth_m));
  }

 private:
  std::uint64_t number(int u, int v) const {
    return static_cast<std::uint64_t>(v) * static_cast<std::uint64_t>(camera_.width_px) +
           static_cast<std::uint64_t>(u);
  }
  const SeenPixel& at(int u, int v) const { return seen_[number(u, v)]; }

  /// Returns the depth of a neighbour that belongs to another surface; 0 if there is none.
  double across_edge_m(int u, int v) const {
    const auto here = static_cast<double>(at(u, v).depth_m);
    for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      if (u + du < 0 || u + du >= camera_.width_px || v + dv < 0 || v + dv >= camera_.height_px) continue;
      const auto other = static_cast<double>(at(u + du, v + dv).depth_m);
      if (other > 0.0 && std::abs(other - here) > noise_.edge_jump_m) return other;
    }
    return 0.0;
  }
  /// Returns what a specular surface seems to be away; 0: nothing comes back.
  double steel_depth_m(const SeenPixel& pixel, int u, int v) const {
    const auto cosine = static_cast<double>(pixel.cos_incidence);
    if (cosine > noise_.glare_cos || cosine < noise_.grazing_cos) return 0.0;
    PixelDice dice(seed_, frame_ / kPatchFrames,
                   kPatches + number(u / noise_.steel_patch_px, v / noise_.steel_patch_px));
    if (dice.uniform() < noise_.steel_dropout) return 0.0;
    if (dice.uniform() < noise_.steel_mirrored) return static_cast<double>(pixel.mirrored_depth_m);
    return static_cast<double>(pixel.depth_m);
  }
  /// Rounds the disparity 1/depth to its step.
  double quantised_m(double depth_m) const {
    if (noise_.quantum_at_1m_m <= 0.0 || depth_m <= 0.0) return depth_m;
    const double steps = std::round(1.0 / (depth_m * noise_.quantum_at_1m_m));
    return steps < 1.0 ? 0.0 : 1.0 / (steps * noise_.quantum_at_1m_m);
  }
  std::uint16_t millimetres(double depth_m) const {
    constexpr double kMax_m = 65.535;
    if (!(depth_m >= camera_.min_depth_m && depth_m <= std::min(kMax_m, camera_.max_depth_m))) return 0;
    return static_cast<std::uint16_t>(std::round(1000.0 * depth_m));
  }

  const PinholeCamera& camera_;
  std::span<const SeenPixel> seen_;
  const DepthNoise& noise_;
  std::uint64_t seed_, frame_;
};

}  // namespace

core::Status check_noise(const DepthNoise& noise) {
  const std::pair<const char*, double> shares[] = {
      {"dropout", noise.dropout},         {"edge_dropout", noise.edge_dropout},
      {"flying", noise.flying},           {"steel_dropout", noise.steel_dropout},
      {"glare_cos", noise.glare_cos},     {"steel_mirrored", noise.steel_mirrored},
      {"grazing_cos", noise.grazing_cos}, {"sigma", noise.sigma.at_1m_m},
      {"edge_jump_m", noise.edge_jump_m}, {"quantum_at_1m_m", noise.quantum_at_1m_m}};
  for (const auto& [name, value] : shares) {
    if (!(value >= 0.0 && value <= 1.0))
      return core::Status::invalid_argument(
          core::formatted("depth noise: %s is %g; allowed: 0 to 1", name, value));
  }
  if (noise.steel_patch_px < 1 || noise.steel_patch_px > kMaxImageEdge_px)
    return core::Status::invalid_argument(core::formatted(
        "depth noise: steel_patch_px is %d; allowed: 1 to %d", noise.steel_patch_px, kMaxImageEdge_px));
  return core::Status::ok();
}

void measure_depth(const PinholeCamera& camera, std::span<const SeenPixel> seen, const DepthNoise& noise,
                   std::uint64_t seed, std::uint64_t frame, std::span<std::uint16_t> depth_mm) {
  const Sensor sensor(camera, seen, noise, seed, frame);
  std::size_t i = 0;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) depth_mm[i++] = sensor.measured_mm(u, v);
  }
}

}  // namespace phantom::fusion
