#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/robot/sensing/sensing_kernel.hpp"

namespace phantom::robot::kernel {
namespace {

Eigen::Vector3d place_of(const Points& points, std::size_t i) {
  return {points.x_m[i], points.y_m[i], points.z_m[i]};
}

Block block_of(const Points& points, std::size_t first, std::size_t end) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = first; i < end; ++i) box.extend(place_of(points, i));
  const Eigen::Vector3d centre = box.center();
  const double weight = points.weight[first];
  double radius = 0.0;
  bool alike = end == first + kBlock;  // a block with padding is not uniform: padding weighs nothing
  for (std::size_t i = first; i < end; ++i) {
    radius = std::max(radius, (place_of(points, i) - centre).norm());
    alike = alike && std::abs(points.weight[i] - weight) <= 1e-14 * weight;
  }
  radius = std::max(radius, 1e-6);
  return {{centre.x(), centre.y(), centre.z()}, radius, radius / 2.1e9, alike ? weight : -1.0};
}

std::int32_t steps_of(double distance_m, double step_m) {
  return static_cast<std::int32_t>(std::lround(distance_m / step_m));
}

}  // namespace

void measure_blocks(const Points& points, std::size_t sensors, Block* blocks, std::int32_t* x,
                    std::int32_t* y, std::int32_t* z) noexcept {
  for (std::size_t first = 0; first < sensors; first += kBlock)
    blocks[first / kBlock] = block_of(points, first, std::min(first + kBlock, sensors));
  for (std::size_t i = 0; i < points.count; ++i) {
    const auto& [centre, radius, step, weight] = blocks[i / kBlock];
    // The padding of the last group stays at the centre, which is inside wherever the block is.
    x[i] = i < sensors ? steps_of(points.x_m[i] - centre[0], step) : 0;
    y[i] = i < sensors ? steps_of(points.y_m[i] - centre[1], step) : 0;
    z[i] = i < sensors ? steps_of(points.z_m[i] - centre[2], step) : 0;
  }
}

}  // namespace phantom::robot::kernel
