#include "common/robot/sensing/viscosity_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace phantom::robot {

ViscosityFilter::ViscosityFilter(std::size_t sensors, const MemoryWeights& weights)
    : depth_(weights.size()), states_(sensors), rings_(sensors * weights.size()) {
  const bool sound =
      !weights.empty() && weights.size() <= kMaxDepth && weights.front() > 0.0 &&
      std::all_of(weights.begin(), weights.end(), [](double w) { return w >= 0.0 && std::isfinite(w); });
  if (!sound) {
    throw std::invalid_argument("memory weights: allowed: 1 to " + std::to_string(kMaxDepth) +
                                " finite numbers, 0 or more, the first above 0");
  }
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::transform(weights.begin(), weights.end(), weights_.begin(), [total](double w) { return w / total; });
}

double ViscosityFilter::mean(std::size_t sensor) const noexcept {
  const float* ring = &rings_[sensor * depth_];
  std::size_t at = states_[sensor].newest;
  double sum = 0.0;
  for (std::size_t age = 0; age < depth_; ++age) {
    sum += weights_[age] * static_cast<double>(ring[at]);
    at = at == 0 ? depth_ - 1 : at - 1;
  }
  return sum;
}

double ViscosityFilter::sense(std::size_t sensor, std::uint32_t voxel, float mu) noexcept {
  State& state = states_[sensor];
  float* ring = &rings_[sensor * depth_];
  if (!state.filled) {
    std::fill_n(ring, depth_, mu);
    state = {static_cast<double>(mu), voxel, 0, true};
    return state.value;
  }
  if (state.voxel == voxel) {
    if (ring[state.newest] == mu) return state.value;
  } else {
    state.voxel = voxel;
    state.newest = static_cast<std::uint8_t>(state.newest + 1U == depth_ ? 0U : state.newest + 1U);
  }
  ring[state.newest] = mu;
  state.value = mean(sensor);
  return state.value;
}

void ViscosityFilter::forget() noexcept {
  for (State& state : states_) state.filled = false;
}

void ViscosityFilter::take_over(std::size_t first, const ViscosityFilter& other, std::size_t other_first,
                                std::size_t count) noexcept {
  std::copy_n(&other.states_[other_first], count, &states_[first]);
  std::copy_n(&other.rings_[other_first * depth_], count * depth_, &rings_[first * depth_]);
}

}  // namespace phantom::robot
