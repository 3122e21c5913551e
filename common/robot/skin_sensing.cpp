#include "common/robot/skin_sensing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::robot {
namespace {

/// A link farther from the grid's origin than this feels nothing. The kernel's integers can hold that many
/// voxels.
constexpr double kFarthest_vox = 1e9;
/// Size of the part that a thread takes at a time: some microseconds of work. Each part is summed, and the
/// parts are added up, in a fixed order, whichever thread takes them.
constexpr std::size_t kPointsOfPart = 16 * kernel::kBlock, kClustersOfPart = 32;

/// ∇μ by central differences, per voxel.
Eigen::Vector3d gradient_per_vox(const workspace::Workspace& workspace, workspace::Index3 at,
                                 int reach) noexcept {
  const auto mu = [&](int x, int y, int z) {
    return static_cast<double>(workspace.mu({at.x + x, at.y + y, at.z + z}));
  };
  return Eigen::Vector3d(mu(reach, 0, 0) - mu(-reach, 0, 0), mu(0, reach, 0) - mu(0, -reach, 0),
                         mu(0, 0, reach) - mu(0, 0, -reach)) /
         (2.0 * reach);
}

/// How far a cluster sensor's zone reaches beyond its place, at most; and a voxel of reserve.
constexpr double kZoneReach_vox = 1.8 * (ClusterSpec::kMostReach_vox + 1);

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Returns the rotation, divided by the voxel size, of a transform to voxels.
Eigen::Map<const RowMajor> rotation_of(const kernel::ToVoxels& to) noexcept {
  return Eigen::Map<const RowMajor>(to.r);
}

/// Also returns false for a pose that is not finite.
bool is_near(const geometry::Pose& X_WL, const workspace::GridSpec& grid) noexcept {
  return X_WL.rotation.allFinite() &&
         (X_WL.translation_m - grid.origin_m).norm() < kFarthest_vox * grid.voxel_size_m;
}

}  // namespace

struct SkinSensing::Totals {
  kernel::Moments moments{};
  kernel::GradientSums slopes{};
  std::size_t active = 0, muted = 0;

  /// Adds what the kernel adds for one sensor of effective viscosity `mu` and gradient `g` per voxel, at
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
  void add(const Totals& other) noexcept {
    for (std::size_t k = 0; k < 10; ++k) moments.sum[k] += other.moments.sum[k];
    for (std::size_t k = 0; k < 7; ++k) slopes.sum[k] += other.slopes.sum[k];
    active += other.active;
    muted += other.muted;
  }
};

/// Sensors of one link that one thread takes: point sensors by packed index, or cluster sensors by index in
/// the layout.
struct alignas(64) SkinSensing::Part {
  std::size_t link, first, end;
  bool clusters;
  Totals totals;
};

bool SkinSensing::MutedObjects::has(std::uint16_t id) const noexcept {
  return std::find(object.begin(), object.begin() + static_cast<std::ptrdiff_t>(count), id) !=
         object.begin() + static_cast<std::ptrdiff_t>(count);
}

std::vector<SkinSensing::Part> SkinSensing::parts_of(const SkinLayout& layout) {
  std::vector<Part> parts;
  std::size_t packed = 0;
  const auto cut = [&parts](std::size_t link, bool clusters, std::size_t first, std::size_t end,
                            std::size_t most) {
    for (; first < end; first += most)
      parts.push_back({link, first, std::min(first + most, end), clusters, {}});
  };
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t points = kernel::whole_groups(layout.first_cluster[link] - layout.first[link]);
    cut(link, false, packed, packed + points, kPointsOfPart);
    packed += points;
    cut(link, true, layout.first_cluster[link], layout.first[link + 1], kClustersOfPart);
  }
  return parts;
}

SkinSensing::SkinSensing(const SkinLayout& layout, const SensingOptions& options)
    : open_(layout),
      layout_(&layout),
      options_(options),
      cluster_codes_(layout.size()),
      neighbourhood_(make_neighbourhood(options.gradient_reach_vox)),
      parts_(parts_of(layout)),
      team_(std::min(std::max<std::size_t>(options.threads, 1), std::max<std::size_t>(parts_.size(), 1))),
      medium_(layout, options.medium) {
  for (const ClusterSpec& kind : layout.clusters) stencils_.emplace_back(kind);
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    packed_first_[link] = x_m_.size();
    for (std::size_t i = layout.first[link]; i < layout.first_cluster[link]; ++i) {
      x_m_.push_back(layout.x_m[i]);
      y_m_.push_back(layout.y_m[i]);
      z_m_.push_back(layout.z_m[i]);
      weight_.push_back(layout.weight[i]);
    }
    const std::size_t packed = kernel::whole_groups(x_m_.size());
    x_m_.resize(packed, 0.0);
    y_m_.resize(packed, 0.0);
    z_m_.resize(packed, 0.0);
    weight_.resize(packed, 0.0);
  }
  packed_first_.back() = x_m_.size();
  for (auto* steps : {&x_steps_, &y_steps_, &z_steps_}) steps->resize(x_m_.size());
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t packed = packed_first_[link];
    const std::size_t sensors = layout.first_cluster[link] - layout.first[link];
    first_block_[link] = blocks_.size();
    for (std::size_t first = 0; first < sensors; first += kernel::kBlock) {
      const MovingBlock block{blocks_.size(), packed + first, std::min(kernel::kBlock, sensors - first)};
      blocks_.emplace_back();
      measure(block);
      const auto moves = [&](const Eigen::Vector3d& way_m) { return !way_m.isZero(0.0); };
      const auto way = layout.closing_m.begin() + static_cast<std::ptrdiff_t>(layout.first[link] + first);
      if (!layout.closing_m.empty() &&
          std::any_of(way, way + static_cast<std::ptrdiff_t>(block.sensors), moves))
        moving_blocks_.push_back(block);
    }
  }
  for (std::size_t i = 0; i < layout.closing_m.size(); ++i)
    if (!layout.closing_m[i].isZero(0.0)) moving_.push_back(i);
  if (!moving_.empty()) layout_ = &moved_.emplace(layout);
  enclose(layout);
  for (std::size_t k = 0; k < std::min(options.moving_fluids, kMostFluids); ++k) {
    SensingOptions alone = options;
    alone.threads = 1;
    alone.moving_fluids = 0;
    alone.medium = {};
    alone.memory.clear();
    in_fluids_.push_back(std::make_unique<SkinSensing>(layout, alone));
  }
  fluid_sums_.resize(in_fluids_.size());
  codes_.resize(x_m_.size());
  mu_.resize(x_m_.size());
  block_worst_.resize(blocks_.size());
  if (!options.memory.empty()) {
    memory_.emplace(x_m_.size(), options.memory);
    voxels_.resize(x_m_.size());
  }
}

SkinSensing::~SkinSensing() = default;

/// Finds a ball about each link's sensors, wherever its fingers are.
void SkinSensing::enclose(const SkinLayout& layout) noexcept {
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    middle_m_[link] = Eigen::Vector3d::Zero();
    const std::size_t count = layout.first[link + 1] - layout.first[link];
    for (std::size_t i = layout.first[link]; i < layout.first[link + 1]; ++i)
      middle_m_[link] += layout.position(i, 0.5) / static_cast<double>(count);
    radius_m_[link] = 0.0;
    for (std::size_t i = layout.first[link]; i < layout.first[link + 1]; ++i)
      for (const double closed : {0.0, 1.0})
        radius_m_[link] = std::max(radius_m_[link], (layout.position(i, closed) - middle_m_[link]).norm());
  }
}

void SkinSensing::measure(const MovingBlock& at) noexcept {
  kernel::measure_blocks(points_of(at.first, at.first + kernel::whole_groups(at.sensors)), at.sensors,
                         &blocks_[at.block], &x_steps_[at.first], &y_steps_[at.first], &z_steps_[at.first]);
}

void SkinSensing::close_gripper(double share) noexcept {
  if (moving_.empty() || share == closed_) return;
  closed_ = share;
  for (const auto& fluid : in_fluids_) fluid->close_gripper(share);
  for (const std::size_t i : moving_) {
    const Eigen::Vector3d at_m = open_.position(i, share);
    moved_->x_m[i] = at_m.x();
    moved_->y_m[i] = at_m.y();
    moved_->z_m[i] = at_m.z();
    const std::size_t link = open_.link_of(i);
    if (i >= open_.first_cluster[link]) continue;
    const std::size_t packed = packed_first_[link] + (i - open_.first[link]);
    x_m_[packed] = at_m.x();
    y_m_[packed] = at_m.y();
    z_m_[packed] = at_m.z();
  }
  for (const MovingBlock& block : moving_blocks_) measure(block);
}

bool SkinSensing::mute(std::size_t link, std::uint16_t object, bool muted) noexcept {
  if (link >= muted_objects_.size()) return false;
  for (const auto& fluid : in_fluids_) fluid->mute(link, object, muted);
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

void SkinSensing::continue_from(const SkinSensing& before, const SkinLayout& own) noexcept {
  if (!memory_ || !before.memory_) return;
  memory_->forget();
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t points = own.first_cluster[link] - own.first[link];
    if (points == 0) continue;
    memory_->take_over(packed_first_[link], *before.memory_, before.packed_first_[link], points);
  }
}

kernel::Points SkinSensing::points_of(std::size_t first, std::size_t end) const noexcept {
  return {&x_m_[first], &y_m_[first], &z_m_[first], &weight_[first], end - first};
}

/// Returns the number of sensors in a part, without the padding of the link's last group.
std::size_t SkinSensing::sensors_of(const Part& part) const noexcept {
  const std::size_t points = layout_->first_cluster[part.link] - layout_->first[part.link];
  return std::min(part.end, packed_first_[part.link] + points) - part.first;
}

/// Applies the kernel's rule to one point.
workspace::Index3 SkinSensing::voxel_of(std::size_t link, const Eigen::Vector3d& p_L_m) const noexcept {
  const kernel::ToVoxels& to = to_voxels_[link];
  const Eigen::Vector3d v = rotation_of(to) * p_L_m + Eigen::Vector3d(to.t);
  const Eigen::Array3i floor = (v.array() + kernel::kBorderShift_vox).floor().cast<int>();
  return {floor.x(), floor.y(), floor.z()};
}

/// With memory, muted objects or moving fluids: looks up, mutes, smooths.
void SkinSensing::look_up(Part& part, const workspace::Workspace& workspace) noexcept {
  const kernel::Points points = points_of(part.first, part.end);
  kernel::look_up(kernel::field_of(workspace), to_voxels_[part.link], points, &codes_[part.first],
                  memory_ ? &voxels_[part.first] : nullptr);
  const MutedObjects& list = muted_objects_[part.link];
  const std::size_t sensors = sensors_of(part);
  // The padding of the last group also has codes, but feels nothing. Code 0 keeps gradients from being
  // computed there.
  std::fill(&codes_[part.first] + sensors, &codes_[part.first] + points.count, std::uint8_t{0});
  // Where all are in free space, as in most moving fluids, what follows would find nothing.
  if (!memory_ && kernel::figures_of(&codes_[part.first], sensors).active == 0) {
    std::fill(&mu_[part.first], &mu_[part.first] + points.count, 0.0);
    return;
  }
  for (std::size_t i = 0; i < sensors; ++i) {
    const std::size_t at = part.first + i;
    std::uint8_t& code = codes_[at];
    if (list.count > 0 && code != 0 &&
        list.has(workspace.object(voxel_of(part.link, {points.x_m[i], points.y_m[i], points.z_m[i]})))) {
      code = 0;
      ++part.totals.muted;
    }
    const float mu = palette_[code];
    mu_[at] = memory_ ? memory_->sense(at, voxels_[at], mu) : static_cast<double>(mu);
  }
}

/// Leaves each sensor of the part in the fluid of greatest μ alone.
void SkinSensing::prevail(Part& part) noexcept {
  std::array<SkinSensing*, kMostFluids + 1> fluids;
  std::size_t count = 0;
  const std::size_t sensors = sensors_of(part), end = part.first + sensors;
  const auto add_if_met = [&](SkinSensing& fluid) {
    if (kernel::figures_of(&fluid.codes_[part.first], sensors).active > 0) fluids[count++] = &fluid;
  };
  add_if_met(*this);
  for (std::size_t k = 0; k < fluids_.size(); ++k)
    if (reached_by_[part.link][k]) add_if_met(*in_fluids_[k]);
  // Each is held against those before it, which have been through this: a sensor is in one of them at most.
  for (std::size_t k = 1; k < count; ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      for (std::size_t at = part.first; at < end; ++at) {
        if (fluids[k]->codes_[at] == 0 || fluids[j]->codes_[at] == 0) continue;
        SkinSensing& loser = fluids[k]->mu_[at] > fluids[j]->mu_[at] ? *fluids[j] : *fluids[k];
        loser.codes_[at] = 0;
        loser.mu_[at] = 0.0;
      }
    }
  }
}

void SkinSensing::add_looked_up(Part& part, const workspace::Workspace& workspace) noexcept {
  const std::size_t sensors = sensors_of(part);
  if (!memory_ && kernel::figures_of(&codes_[part.first], sensors).active == 0) return;
  for (std::size_t at = part.first; at < part.first + sensors; ++at)
    part.totals.active += mu_[at] > 0.0 ? 1U : 0U;
  kernel::add_moments(points_of(part.first, part.end), &mu_[part.first], part.totals.moments);
  note_worst(part, workspace, &mu_[part.first]);
}

/// Keeps the greatest code of each block, and adds the gradients. `mu`: of its sensors, or null where their
/// codes say it.
void SkinSensing::note_worst(Part& part, const workspace::Workspace& workspace, const double* mu) noexcept {
  std::uint8_t worst = 0;
  std::size_t block = first_block_[part.link] + (part.first - packed_first_[part.link]) / kernel::kBlock;
  const std::size_t sensors = sensors_of(part);
  for (std::size_t i = 0; i < sensors; i += kernel::kBlock, ++block) {
    const auto figures = kernel::figures_of(&codes_[part.first + i], std::min(kernel::kBlock, sensors - i));
    block_worst_[block] = figures.greatest;
    worst = std::max(worst, figures.greatest);
    if (mu == nullptr) part.totals.active += figures.active;
  }
  if (options_.gradient && worst != 0) {
    kernel::add_gradients(kernel::field_of(workspace), to_voxels_[part.link], points_of(part.first, part.end),
                          palette_.data(), workspace.palette().size(), &codes_[part.first], mu,
                          options_.gradient_reach_vox, part.totals.slopes);
  }
}

void SkinSensing::sense_points(Part& part, const workspace::Workspace& workspace) noexcept {
  const Fluids& near = reached_by_[part.link];
  if (memory_ || muted_objects_[part.link].count > 0 || near.any()) {
    const auto i = static_cast<std::size_t>(&part - parts_.data());
    look_up(part, workspace);
    for (std::size_t k = 0; k < fluids_.size(); ++k)
      if (near[k]) in_fluids_[k]->look_up(in_fluids_[k]->parts_[i], *fluids_[k].voxels);
    if (near.any()) prevail(part);
    add_looked_up(part, workspace);
    for (std::size_t k = 0; k < fluids_.size(); ++k)
      if (near[k]) in_fluids_[k]->add_looked_up(in_fluids_[k]->parts_[i], *fluids_[k].voxels);
    return;
  }
  const std::size_t block =
      first_block_[part.link] + (part.first - packed_first_[part.link]) / kernel::kBlock;
  const kernel::Offsets offsets{&blocks_[block], &x_steps_[part.first], &y_steps_[part.first],
                                &z_steps_[part.first]};
  kernel::sense(kernel::field_of(workspace), to_voxels_[part.link], points_of(part.first, part.end), offsets,
                palette_.data(), workspace.palette().size(), &codes_[part.first], part.totals.moments);
  note_worst(part, workspace, nullptr);
}

ClusterReading SkinSensing::read_cluster(Part& part, const ClusterStencil& stencil, workspace::Index3 centre,
                                         const workspace::Workspace& workspace) noexcept {
  const MutedObjects& list = muted_objects_[part.link];
  if (list.count == 0) return stencil.read(workspace, centre, response_);
  ClusterReading reading;
  bool silenced = false;
  stencil.for_each(centre, [&](workspace::Index3 voxel, double weight) {
    std::uint8_t code = workspace.mu_code(voxel);
    if (code != 0 && list.has(workspace.object(voxel))) code = 0, silenced = true;
    reading.mean += weight * response_[code];
    reading.greatest = std::max(reading.greatest, code);
  });
  reading.mean /= stencil.total_weight();
  part.totals.muted += silenced ? 1U : 0U;
  return reading;
}

void SkinSensing::add_cluster(Part& part, std::size_t sensor, const ClusterReading& reading,
                              const workspace::Workspace& workspace) noexcept {
  cluster_codes_[sensor] = reading.greatest;
  if (!(reading.mean > 0.0)) return;
  const Eigen::Vector3d p = layout_->position(sensor);
  part.totals.add(layout_->weight[sensor], reading.mean, p);
  if (!options_.gradient) return;
  const Eigen::Vector3d r = rotation_of(to_voxels_[part.link]) * p;
  part.totals.add_slope(layout_->weight[sensor], reading.mean,
                        gradient_per_vox(workspace, voxel_of(part.link, p), options_.gradient_reach_vox), r);
}

void SkinSensing::sense_clusters(Part& part, const workspace::Workspace& workspace) noexcept {
  const auto reading_of = [](SkinSensing& of, Part& in, std::size_t i, const workspace::Workspace& voxels) {
    const workspace::Index3 centre = of.voxel_of(in.link, of.layout_->position(i));
    return of.read_cluster(in, of.stencils_[of.layout_->cluster_kind[i] - std::size_t{1}], centre, voxels);
  };
  const auto index = static_cast<std::size_t>(&part - parts_.data());
  for (std::size_t i = part.first; i < part.end; ++i) {
    ClusterReading best = reading_of(*this, part, i, workspace);
    std::optional<std::size_t> fluid;
    for (std::size_t k = 0; k < fluids_.size(); ++k) {
      if (!reached_by_[part.link][k]) continue;
      const ClusterReading reading =
          reading_of(*in_fluids_[k], in_fluids_[k]->parts_[index], i, *fluids_[k].voxels);
      if (reading.mean > best.mean) best = reading, fluid = k;
    }
    if (!fluid) {
      add_cluster(part, i, best, workspace);
    } else {
      in_fluids_[*fluid]->add_cluster(in_fluids_[*fluid]->parts_[index], i, best, *fluids_[*fluid].voxels);
    }
  }
}

void SkinSensing::place_link(std::size_t link, const geometry::Pose& X_WL,
                             const workspace::GridSpec& grid) noexcept {
  kernel::ToVoxels& to = to_voxels_[link];
  Eigen::Map<RowMajor>(to.r) = X_WL.rotation / grid.voxel_size_m;
  Eigen::Map<Eigen::Vector3d>(to.t) = (X_WL.translation_m - grid.origin_m) / grid.voxel_size_m;
}

/// Adds the sums of a link's parts to the results, about the link's origin in W axes.
void SkinSensing::take(std::size_t link, const Totals& totals, const geometry::Pose& X_WL,
                       double voxel_size_m) noexcept {
  const double* t = totals.moments.sum;
  const double* g = totals.slopes.sum;
  const double s = voxel_size_m;
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
  muted_ += totals.muted;
}

/// Returns whether a fluid's box may hold a sensor of the link.
bool SkinSensing::reaches(const MovingFluid& fluid, std::size_t link,
                          const geometry::Pose& X_WL) const noexcept {
  const workspace::GridSpec& grid = fluid.voxels->grid();
  const Eigen::Vector3d at_B = fluid.X_WB.inverse() * (X_WL * middle_m_[link]);
  const Eigen::Vector3d size_m =
      grid.voxel_size_m * Eigen::Vector3d(grid.size_vox[0], grid.size_vox[1], grid.size_vox[2]);
  const Eigen::Vector3d nearest = at_B.cwiseMax(grid.origin_m).cwiseMin(grid.origin_m + size_m);
  // Anything but a distance that is surely greater: also what is not finite is looked at (and feels nothing).
  return !((at_B - nearest).norm() > radius_m_[link] + kZoneReach_vox * grid.voxel_size_m);
}

/// Notes which fluids reach a link, and places it in those.
void SkinSensing::place_in_fluids(std::size_t link, const geometry::Pose& X_WL) noexcept {
  reached_by_[link].reset();
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    const workspace::GridSpec& grid = fluids_[k].voxels->grid();
    if (grid.voxel_count() <= 0 || !reaches(fluids_[k], link, X_WL)) continue;
    const geometry::Pose X_BL = fluids_[k].X_WB.inverse() * X_WL;
    if (!is_near(X_BL, grid)) continue;
    reached_by_[link][k] = true;
    in_fluids_[k]->place_link(link, X_BL, grid);
    in_fluids_[k]->X_BL_[link] = X_BL;
  }
}

/// Adds what the link feels in moving fluids, whose parts begin beside `first`.
void SkinSensing::take_fluids(std::size_t link, Part& first) noexcept {
  const auto begin = static_cast<std::size_t>(&first - parts_.data());
  std::size_t active = first.totals.active;
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    if (!reached_by_[link][k]) continue;
    SkinSensing& fluid = *in_fluids_[k];
    Totals& totals = fluid.parts_[begin].totals;
    for (std::size_t i = begin + 1; i < parts_.size() && parts_[i].link == link; ++i)
      totals.add(fluid.parts_[i].totals);
    fluid.take(link, totals, fluid.X_BL_[link], fluids_[k].voxels->grid().voxel_size_m);
    fluid_sums_[k][link] = fluid.sums_[link].turned(fluids_[k].X_WB.rotation);
    sums_[link].add(fluid_sums_[k][link]);
    active += totals.active;
    active_ += totals.active;
    muted_ += totals.muted;
    fluid.find_worst(link, fluid.X_BL_, *fluids_[k].voxels);
  }
  if (layout_->normalisation != Normalisation::kActive || active == 0) return;
  sums_[link].scale(1.0 / static_cast<double>(active));
  for (std::size_t k = 0; k < fluids_.size(); ++k)
    fluid_sums_[k][link].scale(1.0 / static_cast<double>(active));
}

/// Takes the worst sensor of the moving fluids, if it is worse than that of the workspace.
void SkinSensing::weigh_fluids(const LinkPoses& X_WL) noexcept {
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    const SkinSensing& fluid = *in_fluids_[k];
    const WorstSensor& other = fluid.worst_;
    if (!other.found || other.mu < worst_.mu ||
        (other.mu == worst_.mu && fluid.worst_around_mu_ <= worst_around_mu_))
      continue;
    worst_ = other;
    worst_.fluid = k + 1;
    worst_.position_W_m = X_WL[other.link] * layout_->position(other.sensor);
    worst_around_mu_ = fluid.worst_around_mu_;
  }
}

/// Forgets the last tick's results, and takes the workspace's palette.
void SkinSensing::start(const workspace::Workspace& workspace) noexcept {
  sums_ = {};
  active_ = muted_ = 0;
  worst_ = {};
  worst_code_ = 0;
  worst_around_mu_ = 0.0;
  std::fill(block_worst_.begin(), block_worst_.end(), std::uint8_t{0});
  if (!layout_->clusters.empty()) std::fill(cluster_codes_.begin(), cluster_codes_.end(), std::uint8_t{0});
  // Codes beyond the palette cannot occur, because the assembler refuses them. The zeros after the palette
  // keep the look-up in bounds anyway.
  palette_.fill(0.0F);
  std::copy(workspace.palette().begin(), workspace.palette().end(), palette_.begin());
  if (!layout_->clusters.empty()) fill_response(options_.response, workspace.palette(), response_);
}

void SkinSensing::sense(const LinkPoses& X_WL, std::size_t joint_count, const workspace::Workspace& workspace,
                        const LinkSet& links, std::span<const MovingFluid> fluids) noexcept {
  medium_.sense(X_WL, joint_count, closed_);
  start(workspace);
  fluids_ = fluids.first(std::min(fluids.size(), in_fluids_.size()));
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    in_fluids_[k]->start(*fluids_[k].voxels);
    fluid_sums_[k] = {};
  }
  sense_also(X_WL, joint_count, workspace, links);
}

void SkinSensing::sense_also(const LinkPoses& X_WL, std::size_t joint_count,
                             const workspace::Workspace& workspace, const LinkSet& links) noexcept {
  const workspace::GridSpec& grid = workspace.grid();
  if (grid.voxel_count() <= 0) return;
  LinkSet felt;
  for (std::size_t link = 1; link <= joint_count; ++link) {
    const bool near = is_near(X_WL[link], grid);
    felt[link] = links[link] && near;
    if (near) place_link(link, X_WL[link], grid);  // all links: consider() looks sensors up, too
    if (felt[link]) place_in_fluids(link, X_WL[link]);
  }
  team_.run(parts_.size(), [&](std::size_t i) {
    Part& part = parts_[i];
    part.totals = {};
    if (!felt[part.link]) return;
    for (std::size_t k = 0; k < fluids_.size(); ++k) in_fluids_[k]->parts_[i].totals = {};
    if (part.clusters) {
      sense_clusters(part, workspace);
    } else {
      sense_points(part, workspace);
    }
  });
  for (auto part = parts_.begin(); part != parts_.end();) {  // a link's parts are added to its first part
    const auto first = part++;
    for (; part != parts_.end() && part->link == first->link; ++part) first->totals.add(part->totals);
    if (!felt[first->link]) continue;
    take(first->link, first->totals, X_WL[first->link], grid.voxel_size_m);
    take_fluids(first->link, *first);
  }
  for (std::size_t link = 1; link <= joint_count; ++link)
    if (felt[link]) find_worst(link, X_WL, workspace);
  weigh_fluids(X_WL);
}

bool SkinSensing::consider(const LinkPoses& X_WL, const workspace::Workspace& workspace, std::size_t sensor,
                           float mu) noexcept {
  const auto& palette = workspace.palette();
  const auto meets = std::find(palette.begin(), palette.end(), mu);
  if (sensor >= layout_->size() || meets == palette.begin() || meets == palette.end()) return false;
  const auto code = static_cast<std::uint8_t>(meets - palette.begin());
  const std::size_t link = layout_->link_of(sensor);
  if (!is_near(X_WL[link], workspace.grid())) return false;
  const auto voxel = place_of(link, sensor, code, workspace);
  if (!voxel || workspace.mu_code(*voxel) != code) return false;
  weigh({link, sensor, code, *voxel, surroundings(*voxel, workspace).mu}, X_WL, workspace);
  return true;
}

}  // namespace phantom::robot
