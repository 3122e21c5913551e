#include "common/robot/tests/sensing_kernel_twin.hpp"

#include <cmath>

namespace phantom::robot::kernel::scalar {
namespace {

struct Place {
  std::int64_t x, y, z;
};

double along(const double* r, const Points& points, std::size_t i) {
  return r[0] * points.x_m[i] + r[1] * points.y_m[i] + r[2] * points.z_m[i];
}

std::int64_t floor_of(double v) {
  return std::abs(v) < 2e9 ? static_cast<std::int64_t>(std::floor(v + kBorderShift_vox)) : -1;
}

Place place_of(const ToVoxels& to, const Points& points, std::size_t i) {
  return {floor_of(along(to.r, points, i) + to.t[0]), floor_of(along(to.r + 3, points, i) + to.t[1]),
          floor_of(along(to.r + 6, points, i) + to.t[2])};
}

std::uint8_t code_at(const Field& field, const Place& p) {
  if (p.x < 0 || p.y < 0 || p.z < 0 || p.x >= field.size_vox[0] || p.y >= field.size_vox[1] ||
      p.z >= field.size_vox[2])
    return 0;
  const auto x = static_cast<std::uint32_t>(p.x), y = static_cast<std::uint32_t>(p.y),
             z = static_cast<std::uint32_t>(p.z);
  const std::size_t bricks_x = static_cast<std::size_t>(field.size_bricks[0]);
  const std::size_t bricks_y = static_cast<std::size_t>(field.size_bricks[1]);
  const std::size_t slot = field.directory[((z >> 5U) * bricks_y + (y >> 5U)) * bricks_x + (x >> 5U)];
  return field.codes[slot * workspace::kBrickVoxels + workspace::brick_offset(x & 31U, y & 31U, z & 31U)];
}

void add(const Points& points, std::size_t i, double mu, double* sum) {
  const double x = points.x_m[i], y = points.y_m[i], z = points.z_m[i], m = mu * points.weight[i];
  const double terms[10] = {1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};
  for (int k = 0; k < 10; ++k) sum[k] += m * terms[k];
}

}  // namespace

void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept {
  for (std::size_t i = 0; i < points.count; ++i) {
    const Place p = place_of(to_voxels, points, i);
    codes[i] = code_at(field, p);
    if (voxels != nullptr)
      voxels[i] = static_cast<std::uint32_t>((p.x & 1023) | (p.y & 1023) << 10 | (p.z & 1023) << 20);
  }
}

void add_moments(const Points& points, const double* mu, Moments& moments) noexcept {
  for (std::size_t i = 0; i < points.count; ++i) add(points, i, mu[i], moments.sum);
}

void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
           std::uint8_t* codes, Moments& moments) noexcept {
  scalar::look_up(field, to_voxels, points, codes, nullptr);
  for (std::size_t i = 0; i < points.count; ++i)
    add(points, i, static_cast<double>(palette[codes[i]]), moments.sum);
}

void add_gradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette,
                   const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) noexcept {
  const std::int64_t n = reach_vox;
  for (std::size_t i = 0; i < points.count; ++i) {
    if (codes[i] == 0) continue;
    const Place p = place_of(to, points, i);
    const auto mu_at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      return static_cast<double>(palette[code_at(field, {p.x + x, p.y + y, p.z + z})]);
    };
    const double per_vox = 1.0 / (2.0 * reach_vox);
    const double g[3] = {per_vox * (mu_at(n, 0, 0) - mu_at(-n, 0, 0)) / to.stretch[0],
                         per_vox * (mu_at(0, n, 0) - mu_at(0, -n, 0)) / to.stretch[1],
                         per_vox * (mu_at(0, 0, n) - mu_at(0, 0, -n)) / to.stretch[2]};
    const double r[3] = {to.stretch[0] * along(to.r, points, i), to.stretch[1] * along(to.r + 3, points, i),
                         to.stretch[2] * along(to.r + 6, points, i)};
    const double w = points.weight[i];
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3;
      sums.sum[k] += w * g[k];
      sums.sum[k + 3] += w * (r[a] * g[b] - r[b] * g[a]);
    }
    const double met = mu != nullptr ? mu[i] : static_cast<double>(palette[codes[i]]);
    sums.sum[6] += w * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) / met;
  }
}

CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept {
  CodeFigures figures;
  for (std::size_t i = 0; i < n; ++i) {
    figures.greatest = codes[i] > figures.greatest ? codes[i] : figures.greatest;
    figures.active += codes[i] != 0 ? 1U : 0U;
  }
  return figures;
}

void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept {
  for (std::size_t c = 1; c < codes; ++c) counts[c] = 0;
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t i = 0; i < 64; ++i) {
      if ((masks[t] >> i & 1U) != 0 && tiles[t][i] != 0) ++counts[tiles[t][i]];
    }
  }
}

}  // namespace phantom::robot::kernel::scalar
