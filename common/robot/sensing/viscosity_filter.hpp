#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace phantom::robot {

/// Weights α of the remembered voxels, newest first; empty: no memory. The thesis's cases (table 4.2): long
/// and short sustained memory (ten or three ones) and fading memory (1, 0.9, 0.75, 0.55, 0.3, 0.2, 0.1, 0.05,
/// 0.02).
using MemoryWeights = std::vector<double>;

/// Smooths the stepped μ that sensors meet. Each sensor remembers the μ of the last voxels on its path and
/// feels their weighted mean (thesis eqs. 4.9, 4.10). Each sensor takes a ring of one float per weight, and
/// 16 bytes.
class ViscosityFilter {
 public:
  static constexpr std::size_t kMaxDepth = 16;
  /// Takes at most kMaxDepth weights, all ≥ 0, the first above 0. Throws std::invalid_argument otherwise.
  ViscosityFilter(std::size_t sensors, const MemoryWeights& weights);

  /// Returns μ_e of a sensor that is in voxel `voxel` (any number that differs between neighbours) of
  /// viscosity `mu`. The ring gets a new entry when the sensor enters another voxel. If μ changes while the
  /// sensor stays, the newest entry changes. The first call fills the whole ring, so there is no delay at the
  /// start. Real-time safe: yes.
  double sense(std::size_t sensor, std::uint32_t voxel, float mu) noexcept;
  /// Forgets everything. Real-time safe: yes.
  void forget() noexcept;
  /// Gives the `count` sensors from `first` on what the sensors of `other` from `other_first` on remember.
  /// Both must have the same weights. Real-time safe: yes.
  void take_over(std::size_t first, const ViscosityFilter& other, std::size_t other_first,
                 std::size_t count) noexcept;

 private:
  struct State {
    double value = 0.0;  // μ_e
    std::uint32_t voxel = 0;
    std::uint8_t newest = 0;
    bool filled = false;
  };
  double mean(std::size_t sensor) const noexcept;

  std::size_t depth_;
  std::array<double, kMaxDepth> weights_{};  // normalised to a sum of 1
  std::vector<State> states_;
  std::vector<float> rings_;  // depth_ entries for each sensor
};

}  // namespace phantom::robot
