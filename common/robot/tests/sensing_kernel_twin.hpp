#pragma once

// The literal twin of the sensing kernel, in plain C++.

#include "common/robot/sensing/sensing_kernel.hpp"

namespace phantom::robot::kernel::scalar {

void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept;
void add_moments(const Points& points, const double* mu, Moments& moments) noexcept;
void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
           std::uint8_t* codes, Moments& moments) noexcept;
void add_gradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette,
                   const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) noexcept;
CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept;
void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept;

}  // namespace phantom::robot::kernel::scalar
