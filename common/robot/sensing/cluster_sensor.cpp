#include "common/robot/sensing/cluster_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "common/robot/sensing/sensing_kernel.hpp"

namespace phantom::robot {
namespace {

constexpr std::size_t kMaxTilesAlong = (2 * ClusterSpec::kMaxReach_vox + 3) / 4 + 1;
constexpr std::size_t kMaxTiles = kMaxTilesAlong * kMaxTilesAlong * kMaxTilesAlong;

// Gauss–Legendre quadrature with 16 nodes: those above 0, and their weights.
constexpr double kNode[] = {0.095012509837637441, 0.28160355077925892, 0.45801677765722737,
                            0.61787624440264377,  0.755404408355003,   0.86563120238783176,
                            0.9445750230732326,   0.98940093499164994};
constexpr double kWeight[] = {0.1894506104550685,   0.18260341504492358, 0.16915651939500254,
                              0.14959598881657674,  0.12462897125553388, 0.095158511682492786,
                              0.062253523938647894, 0.027152459411754096};

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

/// The interval that a voxel takes along an axis.
struct Span {
  double low, high;
  double far() const { return std::max(std::abs(low), std::abs(high)); }
  double near() const { return std::max({0.0, low, -high}); }
};

/// Area of the disc of radius rho around the origin that lies in the rectangle y × z.
double disc_in_rectangle(const Span& y, const Span& z, double rho) {
  if (!(rho > 0.0)) return 0.0;
  return corner_area(y.high, z.high, rho) - corner_area(y.low, z.high, rho) -
         corner_area(y.high, z.low, rho) + corner_area(y.low, z.low, rho);
}

/// Volume of the sphere around the origin, of radius √r2, that lies in the box x × y × z.
double sphere_in_box(const Span& x, const Span& y, const Span& z, double r2) {
  // The slices of the sphere along x are discs cut by a rectangle, whose area has a closed form. That area is
  // smooth between the positions at which the disc reaches an edge or a corner of the rectangle.
  std::vector<double> cuts{x.low, x.high};
  const auto add = [&](double square) {
    if (square > r2) return;
    for (const double at : {std::sqrt(r2 - square), -std::sqrt(r2 - square)}) {
      if (at > x.low && at < x.high) cuts.push_back(at);
    }
  };
  add(0.0);
  for (const double y_edge : {y.low, y.high}) {
    add(y_edge * y_edge);
    for (const double z_edge : {z.low, z.high}) add(z_edge * z_edge), add(y_edge * y_edge + z_edge * z_edge);
  }
  std::sort(cuts.begin(), cuts.end());
  double volume = 0.0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double half = 0.5 * (cuts[i + 1] - cuts[i]), middle = 0.5 * (cuts[i + 1] + cuts[i]);
    for (std::size_t n = 0; n < std::size(kNode); ++n) {
      // The substitution x = middle + half·sin(πu/2) removes the square roots at an interval's ends.
      const double angle = 0.5 * std::numbers::pi * kNode[n];
      for (const double side : {-half, half}) {
        const double at = middle + side * std::sin(angle);
        volume += kWeight[n] * half * 0.5 * std::numbers::pi * std::cos(angle) *
                  disc_in_rectangle(y, z, std::sqrt(std::max(0.0, r2 - at * at)));
      }
    }
  }
  return volume;
}

/// Whether a voxel whose centre is at `offset`, in shortest sides, counts in a zone of a binary shape.
bool is_inside(const ClusterSpec& spec, const Eigen::Vector3d& offset) {
  constexpr double kRounding = 1e-9;  // stretched sides are quotients
  const double m = spec.reach_vox;
  if (spec.shape == ClusterShape::kCube) return offset.cwiseAbs().maxCoeff() <= m + kRounding;
  const double radius = spec.shape == ClusterShape::kSphereContained ? m + 0.5 : m;
  return offset.squaredNorm() <= radius * radius + kRounding;
}

}  // namespace

double fraction_in_sphere(int x, int y, int z, double radius_vox, const Eigen::Vector3d& stretch) {
  const double r2 = radius_vox * radius_vox;
  const auto span = [](int i, double side) { return Span{(i - 0.5) * side, (i + 0.5) * side}; };
  const Span sx = span(x, stretch.x()), sy = span(y, stretch.y()), sz = span(z, stretch.z());
  const auto square = [](double a, double b, double c) { return a * a + b * b + c * c; };
  if (square(sx.far(), sy.far(), sz.far()) <= r2) return 1.0;
  if (square(sx.near(), sy.near(), sz.near()) >= r2) return 0.0;
  return std::clamp(sphere_in_box(sx, sy, sz, r2) / stretch.prod(), 0.0, 1.0);
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

ClusterStencil::ClusterStencil(const ClusterSpec& spec, const Eigen::Vector3d& stretch) {
  ClusterSpec zone = spec;
  zone.reach_vox = std::clamp(spec.reach_vox, 1, ClusterSpec::kMaxReach_vox);
  const double radius = zone.reach_vox + 0.5;
  const auto weight_of = [&](int x, int y, int z) {
    if (zone.shape == ClusterShape::kFraction) return fraction_in_sphere(x, y, z, radius, stretch);
    return is_inside(zone, stretch.cwiseProduct(Eigen::Vector3d(x, y, z))) ? 1.0 : 0.0;
  };
  // Each shape is symmetric and convex, so a row is whole between its ends, and its ends say how far it goes.
  const auto reach_of = [&](auto&& counts) {
    int reach = zone.reach_vox;
    while (reach >= 0 && !counts(reach)) --reach;
    return reach;
  };
  reach_.x = reach_of([&](int i) { return weight_of(i, 0, 0) > 0.0; });
  reach_.y = reach_of([&](int i) { return weight_of(0, i, 0) > 0.0; });
  reach_.z = reach_of([&](int i) { return weight_of(0, 0, i) > 0.0; });
  for (int z = -reach_.z; z <= reach_.z; ++z) {
    for (int y = -reach_.y; y <= reach_.y; ++y) {
      const int reach = reach_of([&](int x) { return weight_of(x, y, z) > 0.0; });
      if (reach < 0) continue;
      rows_.push_back({y, z, reach, weights_.size()});
      voxels_ += static_cast<std::size_t>(2 * reach + 1);
      if (zone.shape != ClusterShape::kFraction) continue;
      for (int x = -reach; x <= reach; ++x) weights_.push_back(weight_of(x, y, z));
    }
  }
  if (weights_.empty()) mask_tiles();
  total_ = weights_.empty() ? static_cast<double>(voxels_)
                            : std::accumulate(weights_.begin(), weights_.end(), 0.0);
}

void ClusterStencil::mask_tiles() {
  for (int place = 0; place < 64; ++place) {
    const int px = place & 3, py = place >> 2 & 3, pz = place >> 4;
    auto& masks = tile_masks_[static_cast<std::size_t>(place)];
    const int nx = tiles_along(px, reach_.x), ny = tiles_along(py, reach_.y), nz = tiles_along(pz, reach_.z);
    masks.assign(static_cast<std::size_t>(nx * ny * nz), 0);
    for (const Row& row : rows_) {
      const int y = py + reach_.y + row.y, z = pz + reach_.z + row.z;
      for (int x = px + reach_.x - row.reach; x <= px + reach_.x + row.reach; ++x)
        masks[static_cast<std::size_t>(((z >> 2) * ny + (y >> 2)) * nx + (x >> 2))] |=
            std::uint64_t{1} << ((z & 3) << 4 | (y & 3) << 2 | (x & 3));
    }
  }
}

namespace {

std::uint32_t within_brick(std::int32_t v) { return static_cast<std::uint32_t>(v) & 31U; }

}  // namespace

/// The zone's bricks, at most two along each axis; each slot is looked up only once.
struct ClusterStencil::Bricks {
  workspace::BrickKey low, high;
  std::array<const std::uint8_t*, 8> codes;  // index: sum of 1 for the higher brick along x, 2 for y, 4 for z

  Bricks(const workspace::Workspace& workspace, workspace::Index3 centre, workspace::Index3 reach) noexcept
      : low(workspace::brick_of(centre - reach)), high(workspace::brick_of(centre + reach)) {
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
  const workspace::Index3 low = centre - reach_;
  const std::uint64_t* mask =
      tile_masks_[static_cast<std::size_t>((low.x & 3) | (low.y & 3) << 2 | (low.z & 3) << 4)].data();
  std::array<const std::uint8_t*, kMaxTiles> tile;
  std::array<std::uint64_t, kMaxTiles + 1> counting;
  std::size_t n = 0;
  const int nx = tiles_along(low.x & 3, reach_.x), ny = tiles_along(low.y & 3, reach_.y),
            nz = tiles_along(low.z & 3, reach_.z);
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
  std::array<std::uint32_t, kMaxCounted> counts;
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

ClusterReading ClusterStencil::read(const workspace::Workspace& workspace, workspace::Index3 centre,
                                    const ResponseTable& response) const noexcept {
  const auto& grid = workspace.grid();
  if (weights_.empty() && workspace.palette().size() <= kMaxCounted && grid.contains(centre - reach_) &&
      grid.contains(centre + reach_))
    return count_inside(workspace, centre, response);
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
