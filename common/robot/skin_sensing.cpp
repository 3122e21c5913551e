#include "common/robot/skin_sensing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::robot {
namespace {

/// Sensors of the greatest μ that are compared by their surroundings, at most; and blocks they are taken from.
constexpr std::size_t kCandidates = 8;
/// Farther from the grid's origin a link feels nothing; the kernel's integers hold that many voxels.
constexpr double kFarthest_vox = 1e9;

constexpr std::size_t whole_groups(std::size_t sensors) {
  return (sensors + kernel::kGroup - 1) / kernel::kGroup * kernel::kGroup;
}

/// ∇μ by central differences, per voxel.
Eigen::Vector3d gradient_per_vox(const voxel::Workspace& workspace, voxel::Index3 at, int reach) noexcept {
  const auto mu = [&](int x, int y, int z) {
    return static_cast<double>(workspace.mu({at.x + x, at.y + y, at.z + z}));
  };
  return Eigen::Vector3d(mu(reach, 0, 0) - mu(-reach, 0, 0), mu(0, reach, 0) - mu(0, -reach, 0),
                         mu(0, 0, reach) - mu(0, 0, -reach)) /
         (2.0 * reach);
}


/// False for a pose that is not finite, too.
bool is_near(const geometry::Pose& X_WL, const voxel::GridSpec& grid) noexcept {
  return X_WL.rotation.allFinite() &&
         (X_WL.translation_m - grid.origin_m).norm() < kFarthest_vox * grid.voxel_size_m;
}

}  // namespace

/// Steps of 1…reach voxels along the axes and the space diagonals, as points to look up.
struct SkinSensing::Star {
  static constexpr int kMostReach_vox = 16;
  static constexpr std::size_t kMost = whole_groups(14 * kMostReach_vox);
  alignas(64) std::array<double, kMost> x{}, y{}, z{}, weight{};
  std::size_t count = 0;

  explicit Star(int reach) {
    for (int direction = 0; direction < 27; ++direction) {
      const int dx = direction % 3 - 1, dy = direction / 3 % 3 - 1, dz = direction / 9 - 1;
      const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
      if (axes != 1 && axes != 3) continue;
      for (int step = 1; step <= std::min(reach, kMostReach_vox); ++step, ++count)
        x[count] = step * dx, y[count] = step * dy, z[count] = step * dz;
    }
  }
};

struct SkinSensing::Totals {
  kernel::Moments moments{};
  kernel::GradientSums slopes{};
  std::size_t active = 0;

  /// What the kernel adds for a point, for one sensor of effective viscosity `mu` and gradient `g` per voxel, at
  /// `p_L_m` in the link's frame and `r_vox` from the link's origin in W axes.
  void add(double weight, double mu, const Eigen::Vector3d& p_L_m) noexcept {
    const double m = weight * mu, x = p_L_m.x(), y = p_L_m.y(), z = p_L_m.z();
    const double terms[10] = {1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};
    for (std::size_t k = 0; k < 10; ++k) moments.sum[k] += m * terms[k];
    ++active;
  }
  void add_slope(double weight, double mu, const Eigen::Vector3d& g, const Eigen::Vector3d& r_vox) noexcept {
    const Eigen::Vector3d turn = r_vox.cross(g);
    for (Eigen::Index k = 0; k < 3; ++k) {
      slopes.sum[k] += weight * g[k];
      slopes.sum[k + 3] += weight * turn[k];
    }
    slopes.sum[6] += weight * g.squaredNorm() / mu;
  }
};

bool SkinSensing::MutedObjects::has(std::uint16_t id) const noexcept {
  return std::find(object.begin(), object.begin() + static_cast<std::ptrdiff_t>(count), id) !=
         object.begin() + static_cast<std::ptrdiff_t>(count);
}

SkinSensing::SkinSensing(const SkinLayout& layout, const SensingOptions& options)
    : layout_(&layout),
      options_(options),
      cluster_codes_(layout.size()),
      star_(std::make_unique<Star>(options.gradient_reach_vox)) {
  for (const ClusterSpec& kind : layout.clusters) stencils_.emplace_back(kind);
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    packed_first_[link] = x_m_.size();
    for (std::size_t i = layout.first[link]; i < layout.first_cluster[link]; ++i) {
      x_m_.push_back(layout.x_m[i]);
      y_m_.push_back(layout.y_m[i]);
      z_m_.push_back(layout.z_m[i]);
      weight_.push_back(layout.weight[i]);
    }
    const std::size_t packed = whole_groups(x_m_.size());
    x_m_.resize(packed, 0.0);
    y_m_.resize(packed, 0.0);
    z_m_.resize(packed, 0.0);
    weight_.resize(packed, 0.0);
  }
  packed_first_.back() = x_m_.size();
  for (auto* steps : {&x_steps_, &y_steps_, &z_steps_}) steps->resize(x_m_.size());
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t packed = packed_first_[link];
    first_block_[link] = blocks_.size();
    if (packed_first_[link + 1] == packed) continue;
    kernel::measure_blocks(points_of(link), layout.first_cluster[link] - layout.first[link], blocks_, &x_steps_[packed],
                           &y_steps_[packed], &z_steps_[packed]);
  }
  codes_.resize(x_m_.size());
  mu_.resize(x_m_.size());
  block_worst_.resize(blocks_.size());
  if (!options.memory.empty()) {
    memory_.emplace(x_m_.size(), options.memory);
    voxels_.resize(x_m_.size());
  }
}

SkinSensing::~SkinSensing() = default;

bool SkinSensing::mute(std::size_t link, std::uint16_t object, bool muted) noexcept {
  if (link >= muted_objects_.size()) return false;
  MutedObjects& list = muted_objects_[link];
  if (list.has(object) == muted) return true;
  if (muted) {
    if (list.count == kMostMuted) return false;
    list.object[list.count++] = object;
  } else {
    *std::find(list.object.begin(), list.object.end(), object) = list.object[list.count - 1];
    --list.count;
  }
  return true;
}

void SkinSensing::forget() noexcept {
  if (memory_) memory_->forget();
}

kernel::Points SkinSensing::points_of(std::size_t link) const noexcept {
  const std::size_t first = packed_first_[link];
  return {&x_m_[first], &y_m_[first], &z_m_[first], &weight_[first], packed_first_[link + 1] - first};
}

std::size_t SkinSensing::clusters_of(std::size_t link) const noexcept {
  return layout_->first[link + 1] - layout_->first_cluster[link];
}

/// The kernel's rule, for one place.
voxel::Index3 SkinSensing::voxel_of(std::size_t link, const Eigen::Vector3d& p_L_m) const noexcept {
  const kernel::ToVoxels& to = to_voxels_[link];
  const auto index = [&](std::size_t axis) {
    const double* r = to.r + 3 * axis;
    const double v = r[0] * p_L_m.x() + r[1] * p_L_m.y() + r[2] * p_L_m.z() + to.t[axis];
    return static_cast<std::int32_t>(std::floor(v + kernel::kBorderShift_vox));
  };
  return {index(0), index(1), index(2)};
}

/// With memory or muted objects: look up, mute, smooth, then sum.
void SkinSensing::sense_slowly(std::size_t link, const voxel::Workspace& workspace, Totals& totals) noexcept {
  const std::size_t first = packed_first_[link];
  const kernel::Points points = points_of(link);
  kernel::look_up(kernel::field_of(workspace), to_voxels_[link], points, &codes_[first],
                  memory_ ? &voxels_[first] : nullptr);
  const MutedObjects& list = muted_objects_[link];
  const std::size_t sensors = layout_->first_cluster[link] - layout_->first[link];
  for (std::size_t i = 0; i < sensors; ++i) {
    std::uint8_t& code = codes_[first + i];
    if (list.count > 0 && code != 0 &&
        list.has(workspace.object(voxel_of(link, {points.x_m[i], points.y_m[i], points.z_m[i]})))) {
      code = 0;
      ++muted_;
    }
    const float mu = palette_[code];
    mu_[first + i] = memory_ ? memory_->sense(first + i, voxels_[first + i], mu) : static_cast<double>(mu);
    totals.active += mu_[first + i] > 0.0 ? 1U : 0U;
  }
  kernel::add_moments(points, &mu_[first], totals.moments);
}

void SkinSensing::sense_points(std::size_t link, const voxel::Workspace& workspace, Totals& totals) noexcept {
  const std::size_t first = packed_first_[link];
  const kernel::Points points = points_of(link);
  const kernel::Field field = kernel::field_of(workspace);
  const bool plain = !memory_ && muted_objects_[link].count == 0;
  if (plain) {
    const kernel::Offsets offsets{&blocks_[first_block_[link]], &x_steps_[first], &y_steps_[first], &z_steps_[first]};
    kernel::sense(field, to_voxels_[link], points, offsets, palette_.data(), workspace.palette().size(),
                  &codes_[first], totals.moments);
  } else {
    sense_slowly(link, workspace, totals);
  }
  std::size_t block = first_block_[link];
  std::uint8_t worst = 0;
  const std::size_t sensors = layout_->first_cluster[link] - layout_->first[link];
  for (std::size_t i = 0; i < sensors; i += kernel::kBlock, ++block) {
    const auto figures = kernel::figures_of(&codes_[first + i], std::min(kernel::kBlock, sensors - i));
    block_worst_[block] = figures.greatest;
    worst = std::max(worst, figures.greatest);
    if (plain) totals.active += figures.active;
  }
  if (options_.gradient && worst != 0) {
    kernel::add_gradients(field, to_voxels_[link], points, palette_.data(),
                          workspace.palette().size(), &codes_[first],
                          plain ? nullptr : &mu_[first], options_.gradient_reach_vox, totals.slopes);
  }
}

ClusterReading SkinSensing::read_cluster(std::size_t link, const ClusterStencil& stencil, voxel::Index3 centre,
                                         const voxel::Workspace& workspace) noexcept {
  const MutedObjects& list = muted_objects_[link];
  if (list.count == 0) return stencil.read(workspace, centre, response_);
  ClusterReading reading;
  bool silenced = false;
  stencil.for_each(centre, [&](voxel::Index3 voxel, double weight) {
    std::uint8_t code = workspace.mu_code(voxel);
    if (code != 0 && list.has(workspace.object(voxel))) code = 0, silenced = true;
    reading.mean += weight * response_[code];
    reading.greatest = std::max(reading.greatest, code);
  });
  reading.mean /= stencil.total_weight();
  muted_ += silenced ? 1U : 0U;
  return reading;
}

void SkinSensing::sense_clusters(std::size_t link, const voxel::Workspace& workspace, Totals& totals) noexcept {
  const kernel::ToVoxels& to = to_voxels_[link];
  for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1]; ++i) {
    const Eigen::Vector3d p = layout_->position(i);
    const voxel::Index3 centre = voxel_of(link, p);
    const ClusterReading reading =
        read_cluster(link, stencils_[layout_->cluster_kind[i] - std::size_t{1}], centre, workspace);
    cluster_codes_[i] = reading.greatest;
    if (!(reading.mean > 0.0)) continue;
    totals.add(layout_->weight[i], reading.mean, p);
    if (!options_.gradient) continue;
    const Eigen::Vector3d r(to.r[0] * p.x() + to.r[1] * p.y() + to.r[2] * p.z(),
                            to.r[3] * p.x() + to.r[4] * p.y() + to.r[5] * p.z(),
                            to.r[6] * p.x() + to.r[7] * p.y() + to.r[8] * p.z());
    totals.add_slope(layout_->weight[i], reading.mean,
                     gradient_per_vox(workspace, centre, options_.gradient_reach_vox), r);
  }
}

void SkinSensing::sense_link(std::size_t link, const geometry::Pose& X_WL,
                             const voxel::Workspace& workspace) noexcept {
  const voxel::GridSpec& grid = workspace.grid();
  const double s = grid.voxel_size_m;
  const Eigen::Vector3d origin = (X_WL.translation_m - grid.origin_m) / s;
  kernel::ToVoxels& to = to_voxels_[link];
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) to.r[3 * row + column] = X_WL.rotation(row, column) / s;
    to.t[row] = origin[row];
  }
  Totals totals;
  if (packed_first_[link + 1] > packed_first_[link]) sense_points(link, workspace, totals);
  if (clusters_of(link) > 0) sense_clusters(link, workspace, totals);

  const double* t = totals.moments.sum;
  const double* g = totals.slopes.sum;
  ViscousSums& sums = sums_[link];
  sums.mu = t[0];
  sums.mu_d = X_WL.rotation * Eigen::Vector3d(t[1], t[2], t[3]);
  Eigen::Matrix3d second;
  second << t[4], t[5], t[6], t[5], t[7], t[8], t[6], t[8], t[9];
  sums.mu_dd = X_WL.rotation * second * X_WL.rotation.transpose();
  sums.gradient = Eigen::Vector3d(g[0], g[1], g[2]) / s;
  sums.gradient_moment = {g[3], g[4], g[5]};
  sums.gradient_square = g[6] / (s * s);
  active_ += totals.active;
  if (layout_->normalisation == Normalisation::kActive && totals.active > 0)
    sums.scale(1.0 / static_cast<double>(totals.active));
}

/// Sensors that meet a code, as they are found.
struct SkinSensing::Ties {
  struct Tie {
    std::uint32_t link, sensor;
  };
  static constexpr std::size_t kMost = kCandidates * (kernel::kBlock + 1);
  std::array<Tie, kMost> tie;
  std::size_t count = 0;
};

/// Sensors that meet `code`: of at most kCandidates blocks of points, evenly chosen among those that hold it, and as
/// many clusters.
void SkinSensing::find_ties(std::uint8_t code, Ties& ties) const noexcept {
  const auto holders = static_cast<std::size_t>(std::count(block_worst_.begin(), block_worst_.end(), code));
  const std::size_t stride = (holders + kCandidates - 1) / kCandidates;
  std::size_t block = 0, holder = 0, clusters = 0;
  for (std::uint32_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t packed = packed_first_[link], points = layout_->first_cluster[link] - layout_->first[link];
    for (std::size_t first = 0; packed + first < packed_first_[link + 1]; first += kernel::kBlock, ++block) {
      if (block_worst_[block] != code || holder++ % stride != 0) continue;
      const std::size_t end = std::min(first + kernel::kBlock, points);
      for (std::size_t i = first; i < end; ++i) {  // no branch on what is there: written, and kept if it holds
        ties.tie[ties.count] = {link, static_cast<std::uint32_t>(layout_->first[link] + i)};
        ties.count += codes_[packed + i] == code ? 1U : 0U;
      }
    }
    for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1] && clusters < kCandidates; ++i) {
      if (cluster_codes_[i] != code) continue;
      ties.tie[ties.count++] = {link, static_cast<std::uint32_t>(i)};
      ++clusters;
    }
  }
}

/// Sum of μ on the star around a voxel: rises voxel by voxel towards the object, also within a layer.
double SkinSensing::surroundings(voxel::Index3 at, const voxel::Workspace& workspace) const noexcept {
  const Star& star = *star_;
  const kernel::ToVoxels shift{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {at.x + 0.5, at.y + 0.5, at.z + 0.5}};
  std::array<std::uint8_t, Star::kMost> codes;
  kernel::look_up(kernel::field_of(workspace), shift,
                  {star.x.data(), star.y.data(), star.z.data(), star.weight.data(), whole_groups(star.count)},
                  codes.data(), nullptr);
  double sum = 0.0;
  for (std::size_t i = 0; i < star.count; ++i) sum += static_cast<double>(palette_[codes[i]]);
  return sum;
}

/// The voxel in which a sensor meets a code: its own, or the nearest of its zone.
std::optional<voxel::Index3> SkinSensing::place_of(std::size_t link, std::size_t sensor, std::uint8_t code,
                                                   const voxel::Workspace& workspace) const noexcept {
  const voxel::Index3 centre = voxel_of(link, layout_->position(sensor));
  const std::uint8_t kind = layout_->cluster_kind[sensor];
  if (kind == 0) return centre;
  std::optional<voxel::Index3> nearest;
  int nearest_square = 0;
  const MutedObjects& list = muted_objects_[link];
  stencils_[kind - std::size_t{1}].for_each(centre, [&](voxel::Index3 voxel, double) {
    const int x = voxel.x - centre.x, y = voxel.y - centre.y, z = voxel.z - centre.z;
    const int square = x * x + y * y + z * z;
    if (nearest && square >= nearest_square) return;
    if (workspace.mu_code(voxel) != code || (list.count > 0 && list.has(workspace.object(voxel)))) return;
    nearest = voxel, nearest_square = square;
  });
  return nearest;
}

/// Picks evenly among the sensors of the greatest code if there are many.
void SkinSensing::find_worst(const LinkPoses& X_WL, const voxel::Workspace& workspace) noexcept {
  std::uint8_t greatest = 0;
  for (const std::uint8_t worst : block_worst_) greatest = std::max(greatest, worst);
  if (!layout_->clusters.empty()) {
    for (const std::uint8_t worst : cluster_codes_) greatest = std::max(greatest, worst);
  }
  if (greatest == 0) return;
  Ties ties;
  find_ties(greatest, ties);
  const std::size_t stride = (ties.count + kCandidates - 1) / kCandidates;
  double best = -1.0;
  for (std::size_t i = 0; i < ties.count; i += stride) {
    const auto [link, sensor] = ties.tie[i];
    const auto voxel = place_of(link, sensor, greatest, workspace);
    if (!voxel) continue;
    const double around = surroundings(*voxel, workspace);
    if (around <= best) continue;
    best = around;
    worst_ = {true,
              sensor,
              link,
              *voxel,
              X_WL[link] * layout_->position(sensor),
              workspace.palette()[greatest],
              workspace.order(*voxel),
              workspace.object(*voxel)};
  }
}

void SkinSensing::sense(const LinkPoses& X_WL, std::size_t joint_count,
                        const voxel::Workspace& workspace) noexcept {
  sums_ = {};
  active_ = muted_ = 0;
  worst_ = {};
  std::fill(block_worst_.begin(), block_worst_.end(), std::uint8_t{0});
  if (!layout_->clusters.empty()) std::fill(cluster_codes_.begin(), cluster_codes_.end(), std::uint8_t{0});
  if (workspace.grid().voxel_count() <= 0) return;
  // Codes past the palette cannot be: the assembler refuses them. The zeros after it keep the look-up in
  // bounds anyway.
  palette_.fill(0.0F);
  std::copy(workspace.palette().begin(), workspace.palette().end(), palette_.begin());
  if (!layout_->clusters.empty()) fill_response(options_.response, workspace.palette(), response_);
  for (std::size_t link = 1; link <= joint_count; ++link) {
    if (is_near(X_WL[link], workspace.grid())) sense_link(link, X_WL[link], workspace);
  }
  find_worst(X_WL, workspace);
}

}  // namespace phantom::robot
