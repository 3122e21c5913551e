#include "common/robot/cluster_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>

#include "common/robot/sensing_kernel.hpp"

namespace phantom::robot {
namespace {

constexpr int kNodes = 16;
constexpr std::size_t kMostTilesAlong = (2 * ClusterSpec::kMostReach_vox + 3) / 4 + 1;
constexpr std::size_t kMostTiles = kMostTilesAlong * kMostTilesAlong * kMostTilesAlong;

struct Quadrature {
  std::array<double, kNodes> node, weight;  // on −1…1
};

/// Gauss–Legendre nodes and weights, by Newton's method.
Quadrature gauss_legendre() {
  Quadrature rule{};
  for (int i = 0; i < kNodes; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (kNodes + 0.5)), slope = 1.0;
    for (int iteration = 0; iteration < 50; ++iteration) {
      double before = 1.0, now = x;
      for (int n = 2; n <= kNodes; ++n) {
        const double next = ((2 * n - 1) * x * now - (n - 1) * before) / n;
        before = now, now = next;
      }
      slope = kNodes * (x * now - before) / (x * x - 1.0);
      const double step = now / slope;
      x -= step;
      if (std::abs(step) < 1e-15) break;
    }
    rule.node[static_cast<std::size_t>(i)] = x;
    rule.weight[static_cast<std::size_t>(i)] = 2.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

/// Area of the disc of radius rho around the origin that lies in [0,y]×[0,z]; odd in y and z.
double corner_area(double y, double z, double rho) {
  const double sign = (y < 0.0) != (z < 0.0) ? -1.0 : 1.0;
  y = std::min(std::abs(y), rho), z = std::min(std::abs(z), rho);
  if (y * y + z * z <= rho * rho) return sign * y * z;
  const auto under_arc = [rho](double t) {
    return 0.5 *
           (t * std::sqrt(std::max(0.0, rho * rho - t * t)) + rho * rho * std::asin(std::min(1.0, t / rho)));
  };
  const double meets = std::sqrt(std::max(0.0, rho * rho - z * z));
  return sign * (meets * z + under_arc(y) - under_arc(meets));
}

/// Area of the disc of radius rho around the origin that lies in the unit square centred at (y,z).
double disc_in_square(int y, int z, double rho) {
  if (!(rho > 0.0)) return 0.0;
  return corner_area(y + 0.5, z + 0.5, rho) - corner_area(y - 0.5, z + 0.5, rho) -
         corner_area(y + 0.5, z - 0.5, rho) + corner_area(y - 0.5, z - 0.5, rho);
}

}  // namespace

double fraction_in_sphere(int x, int y, int z, double radius_vox) {
  static const Quadrature rule = gauss_legendre();
  const double r2 = radius_vox * radius_vox;
  const auto far = [](int i) { return std::abs(i) + 0.5; };
  const auto near = [](int i) { return std::max(0.0, std::abs(i) - 0.5); };
  if (far(x) * far(x) + far(y) * far(y) + far(z) * far(z) <= r2) return 1.0;
  if (near(x) * near(x) + near(y) * near(y) + near(z) * near(z) >= r2) return 0.0;
  // The slices of the sphere along x are discs cut by a square, whose area has a closed form. That area is
  // smooth between the positions at which the disc reaches an edge or a corner of the square.
  std::vector<double> cuts{x - 0.5, x + 0.5};
  const auto add = [&](double square) {
    if (square > r2) return;
    for (const double at : {std::sqrt(r2 - square), -std::sqrt(r2 - square)}) {
      if (at > x - 0.5 && at < x + 0.5) cuts.push_back(at);
    }
  };
  add(0.0);
  for (const double y_edge : {y - 0.5, y + 0.5}) {
    add(y_edge * y_edge);
    for (const double z_edge : {z - 0.5, z + 0.5})
      add(z_edge * z_edge), add(y_edge * y_edge + z_edge * z_edge);
  }
  std::sort(cuts.begin(), cuts.end());
  double volume = 0.0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double half = 0.5 * (cuts[i + 1] - cuts[i]), middle = 0.5 * (cuts[i + 1] + cuts[i]);
    for (std::size_t n = 0; n < kNodes; ++n) {
      // The substitution x = middle + half·sin(πu/2) removes the square roots at an interval's ends.
      const double angle = 0.5 * std::numbers::pi * rule.node[n];
      const double at = middle + half * std::sin(angle);
      volume += rule.weight[n] * half * 0.5 * std::numbers::pi * std::cos(angle) *
                disc_in_square(y, z, std::sqrt(std::max(0.0, r2 - at * at)));
    }
  }
  return std::clamp(volume, 0.0, 1.0);
}

ResponseCurve::ResponseCurve(std::vector<std::pair<double, double>> points) : points_(std::move(points)) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto [mu, response] = points_[i];
    if (!std::isfinite(mu) || !(response >= 0.0) || !std::isfinite(response) ||
        (i > 0 && !(mu > points_[i - 1].first)))
      throw std::invalid_argument("response: point " + std::to_string(i) +
                                  ": viscosities must rise strictly and responses be 0 or more");
  }
}

double ResponseCurve::operator()(double mu) const noexcept {
  if (points_.empty()) return mu;
  const auto after = std::upper_bound(points_.begin(), points_.end(), mu,
                                      [](double value, const auto& point) { return value < point.first; });
  if (after == points_.begin()) return points_.front().second;
  if (after == points_.end()) return points_.back().second;
  const auto& [mu0, r0] = *(after - 1);
  return r0 + (mu - mu0) / (after->first - mu0) * (after->second - r0);
}

void fill_response(const ResponseCurve& curve, const std::vector<float>& palette,
                   ResponseTable& table) noexcept {
  table.fill(0.0);
  for (std::size_t code = 0; code < std::min(palette.size(), table.size()); ++code)
    table[code] = curve(static_cast<double>(palette[code]));
}

ClusterStencil::ClusterStencil(const ClusterSpec& spec)
    : reach_(std::clamp(spec.reach_vox, 1, ClusterSpec::kMostReach_vox)) {
  for (int z = -reach_; z <= reach_; ++z) {
    for (int y = -reach_; y <= reach_; ++y) {
      int reach = reach_;
      if (spec.shape == ClusterShape::kSphere) {
        const int left = reach_ * reach_ - y * y - z * z;
        if (left < 0) continue;
        while (reach * reach > left) --reach;
      }
      if (spec.shape == ClusterShape::kFraction) {
        while (reach >= 0 && fraction_in_sphere(reach, y, z, reach_ + 0.5) <= 0.0) --reach;
        if (reach < 0) continue;
      }
      rows_.push_back({y, z, reach, weights_.size()});
      voxels_ += static_cast<std::size_t>(2 * reach + 1);
      if (spec.shape != ClusterShape::kFraction) continue;
      for (int x = -reach; x <= reach; ++x) weights_.push_back(fraction_in_sphere(x, y, z, reach_ + 0.5));
    }
  }
  if (weights_.empty()) mask_tiles();
  total_ = static_cast<double>(voxels_);
  if (!weights_.empty()) {
    total_ = 0.0;
    for (const double w : weights_) total_ += w;
  }
}

void ClusterStencil::mask_tiles() {
  for (int place = 0; place < 64; ++place) {
    const int px = place & 3, py = place >> 2 & 3, pz = place >> 4;
    auto& masks = tile_masks_[static_cast<std::size_t>(place)];
    const int nx = tiles_along(px), ny = tiles_along(py), nz = tiles_along(pz);
    masks.assign(static_cast<std::size_t>(nx * ny * nz), 0);
    for (const Row& row : rows_) {
      const int y = py + reach_ + row.y, z = pz + reach_ + row.z;
      for (int x = px + reach_ - row.reach; x <= px + reach_ + row.reach; ++x)
        masks[static_cast<std::size_t>(((z >> 2) * ny + (y >> 2)) * nx + (x >> 2))] |=
            std::uint64_t{1} << ((z & 3) << 4 | (y & 3) << 2 | (x & 3));
    }
  }
}

namespace {

std::uint32_t within_brick(std::int32_t v) { return static_cast<std::uint32_t>(v) & 31U; }

/// Four running sums and two greatest codes, so that the additions can overlap.
template <bool kWeighted>
struct Tally {
  const double* response;
  double sum[4] = {};
  unsigned greatest[2] = {};

  /// Adds n voxels at codes[column[i]], with weights w.
  void add(const std::uint8_t* codes, const std::uint32_t* column, const double* w, int n) noexcept {
    const auto one = [&](int i, int lane) {
      const unsigned code = codes[column[i]];
      sum[lane] += kWeighted ? w[i] * response[code] : response[code];
      greatest[lane & 1] = std::max(greatest[lane & 1], code);
    };
    int i = 0;
    for (; i + 4 <= n; i += 4) one(i, 0), one(i + 1, 1), one(i + 2, 2), one(i + 3, 3);
    if (i < n) one(i, 0);
    if (i + 1 < n) one(i + 1, 1);
    if (i + 2 < n) one(i + 2, 2);
  }
};

}  // namespace

/// The zone's bricks, at most two along each axis; each slot is looked up only once.
struct ClusterStencil::Bricks {
  workspace::BrickKey low, high;
  std::array<const std::uint8_t*, 8> codes;  // index: sum of 1 for the higher brick along x, 2 for y, 4 for z

  Bricks(const workspace::Workspace& workspace, workspace::Index3 centre, int reach) noexcept
      : low{(centre.x - reach) >> 5, (centre.y - reach) >> 5, (centre.z - reach) >> 5},
        high{(centre.x + reach) >> 5, (centre.y + reach) >> 5, (centre.z + reach) >> 5} {
    const std::uint32_t* slot = workspace.directory() + workspace.directory_index(low);
    const std::size_t up_x = high.x > low.x ? 1 : 0;
    const std::size_t up_y = high.y > low.y ? workspace.directory_index({0, 1, 0}) : 0;
    const std::size_t up_z = high.z > low.z ? workspace.directory_index({0, 0, 1}) : 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const std::size_t at = (corner & 1U) * up_x + (corner >> 1 & 1U) * up_y + (corner >> 2) * up_z;
      codes[corner] = workspace.codes() + slot[at] * workspace::kBrickVoxels;
    }
  }
  unsigned corner_of(std::int32_t y, std::int32_t z) const noexcept {
    return ((y >> 5) > low.y ? 2U : 0U) | ((z >> 5) > low.z ? 4U : 0U);
  }
};

/// Reads a binary shape: counts each code in the zone's tiles.
ClusterReading ClusterStencil::count_inside(const workspace::Workspace& workspace, workspace::Index3 centre,
                                            const ResponseTable& response) const noexcept {
  const Bricks bricks(workspace, centre, reach_);
  const workspace::Index3 low{centre.x - reach_, centre.y - reach_, centre.z - reach_};
  const std::uint64_t* mask =
      tile_masks_[static_cast<std::size_t>((low.x & 3) | (low.y & 3) << 2 | (low.z & 3) << 4)].data();
  std::array<const std::uint8_t*, kMostTiles> tile;
  std::array<std::uint64_t, kMostTiles + 1> counting;
  std::size_t n = 0;
  const int nx = tiles_along(low.x & 3), ny = tiles_along(low.y & 3), nz = tiles_along(low.z & 3);
  for (std::int32_t iz = 0, z = low.z & ~3; iz < nz; ++iz, z += 4) {
    for (std::int32_t iy = 0, y = low.y & ~3; iy < ny; ++iy, y += 4) {
      const std::uint8_t* const* sides = &bricks.codes[bricks.corner_of(y, z)];
      const std::size_t row = workspace::brick_offset(0, within_brick(y), within_brick(z));
      for (std::int32_t ix = 0, x = low.x & ~3; ix < nx; ++ix, x += 4) {
        tile[n] =
            sides[(x >> 5) > bricks.low.x ? 1 : 0] + row + workspace::brick_offset(within_brick(x), 0, 0);
        counting[n] = *mask++;
        n += counting[n] != 0 ? 1U : 0U;  // tiles in the corners of a sphere hold no voxel that counts
      }
    }
  }
  std::array<std::uint32_t, kMostCounted> counts;
  const std::size_t codes = workspace.palette().size();
  kernel::count_codes(tile.data(), counting.data(), n, codes, counts.data());

  ClusterReading reading;
  std::size_t in_fluid = 0;
  for (std::size_t code = 1; code < codes; ++code) {
    in_fluid += counts[code];
    reading.mean += counts[code] * response[code];
    if (counts[code] > 0) reading.greatest = static_cast<std::uint8_t>(code);
  }
  reading.mean = (reading.mean + static_cast<double>(voxels_ - in_fluid) * response[0]) / total_;
  return reading;
}

/// Reads the zone voxel by voxel.
template <bool kWeighted>
ClusterReading ClusterStencil::read_inside(const workspace::Workspace& workspace, workspace::Index3 centre,
                                           const ResponseTable& response) const noexcept {
  const Bricks bricks(workspace, centre, reach_);
  // Offsets of the zone's columns within their brick, and the first column of the second brick.
  std::array<std::uint32_t, 2 * ClusterSpec::kMostReach_vox + 1> column;
  for (int x = -reach_; x <= reach_; ++x)
    column[static_cast<std::size_t>(x + reach_)] =
        static_cast<std::uint32_t>(workspace::brick_offset(within_brick(centre.x + x), 0, 0));
  const int border =
      bricks.high.x > bricks.low.x ? bricks.high.x * workspace::kBrickEdge - centre.x : reach_ + 1;

  Tally<kWeighted> tally{response.data()};
  for (const Row& row : rows_) {
    const std::int32_t y = centre.y + row.y, z = centre.z + row.z;
    const unsigned corner = bricks.corner_of(y, z);
    const std::size_t offset = workspace::brick_offset(0, within_brick(y), within_brick(z));
    const std::uint32_t* columns = &column[static_cast<std::size_t>(reach_ - row.reach)];
    const double* w = kWeighted ? &weights_[row.first_weight] : nullptr;
    const int all = 2 * row.reach + 1, first = std::clamp(border + row.reach, 0, all);
    tally.add(bricks.codes[corner] + offset, columns, w, first);
    if (first < all)
      tally.add(bricks.codes[corner | 1U] + offset, columns + first, w + (kWeighted ? first : 0),
                all - first);
  }
  return {(tally.sum[0] + tally.sum[1] + tally.sum[2] + tally.sum[3]) / total_,
          static_cast<std::uint8_t>(std::max(tally.greatest[0], tally.greatest[1]))};
}

ClusterReading ClusterStencil::read(const workspace::Workspace& workspace, workspace::Index3 centre,
                                    const ResponseTable& response) const noexcept {
  const auto& grid = workspace.grid();
  if (grid.contains({centre.x - reach_, centre.y - reach_, centre.z - reach_}) &&
      grid.contains({centre.x + reach_, centre.y + reach_, centre.z + reach_})) {
    if (!weights_.empty()) return read_inside<true>(workspace, centre, response);
    return workspace.palette().size() <= kMostCounted ? count_inside(workspace, centre, response)
                                                      : read_inside<false>(workspace, centre, response);
  }
  ClusterReading reading;
  for_each(centre, [&](workspace::Index3 voxel, double w) {
    const std::uint8_t code = workspace.mu_code(voxel);
    reading.mean += w * response[code];
    reading.greatest = std::max(reading.greatest, code);
  });
  reading.mean /= total_;
  return reading;
}

}  // namespace phantom::robot
