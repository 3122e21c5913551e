#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/robot/sensing/skin_sensing_parts.hpp"

namespace phantom::robot {
namespace {

/// ∇μ by central differences, per reference length.
Eigen::Vector3d gradient_of(const workspace::Workspace& workspace, workspace::Index3 at,
                            const Eigen::Vector3d& stretch, int reach) noexcept {
  const auto mu = [&](int x, int y, int z) {
    return static_cast<double>(workspace.mu({at.x + x, at.y + y, at.z + z}));
  };
  return Eigen::Vector3d(mu(reach, 0, 0) - mu(-reach, 0, 0), mu(0, reach, 0) - mu(0, -reach, 0),
                         mu(0, 0, reach) - mu(0, 0, -reach))
             .cwiseQuotient(stretch) /
         (2.0 * reach);
}

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Returns the rotation of a transform to voxels, its rows divided by the voxel's sides.
Eigen::Map<const RowMajor> rotation_of(const kernel::ToVoxels& to) noexcept {
  return Eigen::Map<const RowMajor>(to.r);
}

}  // namespace

bool SkinSensing::MutedObjects::has(std::uint16_t id) const noexcept {
  return std::find(object.begin(), object.begin() + static_cast<std::ptrdiff_t>(count), id) !=
         object.begin() + static_cast<std::ptrdiff_t>(count);
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
  const Eigen::Vector3d stretch(to_voxels_[part.link].stretch);
  const Eigen::Vector3d r = (rotation_of(to_voxels_[part.link]) * p).cwiseProduct(stretch);
  part.totals.add_slope(layout_->weight[sensor], reading.mean,
                        gradient_of(workspace, voxel_of(part.link, p), stretch, options_.gradient_reach_vox),
                        r);
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
  const Eigen::Vector3d& sides_m = grid.voxel_size_m.sides_m();
  Eigen::Map<RowMajor>(to.r) = X_WL.rotation.array().colwise() / sides_m.array();
  Eigen::Map<Eigen::Vector3d>(to.t) = grid.to_voxels(X_WL.translation_m);
  Eigen::Map<Eigen::Vector3d>(to.stretch) = grid.voxel_size_m.stretch();
}

/// Adds the sums of a link's parts to the results, about the link's origin in W axes.
void SkinSensing::take(std::size_t link, const Totals& totals, const geometry::Pose& X_WL,
                       double reference_m) noexcept {
  const double* t = totals.moments.sum;
  const double* g = totals.slopes.sum;
  const double s = reference_m;
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

/// Forgets the last tick's results, and takes the workspace's palette.
void SkinSensing::start(const workspace::Workspace& workspace) noexcept {
  sums_ = {};
  active_ = muted_ = 0;
  worst_ = {};
  for (WorstSensor& worst : worst_of_links_) worst.found = false;
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
    take(first->link, first->totals, X_WL[first->link], grid.voxel_size_m.reference_m());
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
