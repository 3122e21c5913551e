// Finds the sensor that the percept reports: the one in the greatest μ or, of several, the nearest to the
// object.
#include <algorithm>
#include <limits>

#include "common/robot/skin_sensing.hpp"

namespace phantom::robot {
namespace {

/// Greatest number of blocks of points, and of cluster sensors, from which candidates are taken.
constexpr std::size_t kCandidates = 8;
/// Number of candidates, evenly chosen, whose surroundings are read first.
constexpr std::size_t kFirstSamples = 3;

}  // namespace

/// Steps of 1…reach voxels along the axes and the space diagonals, as points to look up.
struct SkinSensing::Neighbourhood {
  static constexpr int kMostReach_vox = 16;
  static constexpr std::size_t kMost = kernel::whole_groups(14 * kMostReach_vox);
  alignas(64) std::array<double, kMost> x{}, y{}, z{}, weight{};
  std::size_t count = 0;

  explicit Neighbourhood(int reach) {
    for (int direction = 0; direction < 27; ++direction) {
      const int dx = direction % 3 - 1, dy = direction / 3 % 3 - 1, dz = direction / 9 - 1;
      const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
      if (axes != 1 && axes != 3) continue;
      for (int step = 1; step <= std::min(reach, kMostReach_vox); ++step, ++count)
        x[count] = step * dx, y[count] = step * dy, z[count] = step * dz;
    }
  }
};

std::shared_ptr<const SkinSensing::Neighbourhood> SkinSensing::make_neighbourhood(int reach_vox) {
  return std::make_shared<const Neighbourhood>(reach_vox);
}

/// Sensors that meet a given code, collected one after another.
struct SkinSensing::WorstCandidates {
  struct Candidate {
    std::uint32_t link, sensor;
  };
  static constexpr std::size_t kMost = kCandidates * (kernel::kBlock + 1);
  std::array<Candidate, kMost> item;
  std::size_t count = 0;
};

/// Finds sensors that meet `code`: those in at most kCandidates blocks of points, evenly chosen among the
/// blocks that hold it, and as many clusters.
void SkinSensing::find_worst_candidates(std::uint8_t code, WorstCandidates& candidates) const noexcept {
  const auto holders = static_cast<std::size_t>(std::count(block_worst_.begin(), block_worst_.end(), code));
  const std::size_t stride = (holders + kCandidates - 1) / kCandidates;
  std::size_t block = 0, holder = 0, clusters = 0;
  for (std::uint32_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t packed = packed_first_[link],
                      points = layout_->first_cluster[link] - layout_->first[link];
    for (std::size_t first = 0; packed + first < packed_first_[link + 1]; first += kernel::kBlock, ++block) {
      if (block_worst_[block] != code || holder++ % stride != 0) continue;
      const std::size_t end = std::min(first + kernel::kBlock, points);
      for (std::size_t i = first; i < end;
           ++i) {  // without a branch on the code: always written, kept only if it holds
        candidates.item[candidates.count] = {link, static_cast<std::uint32_t>(layout_->first[link] + i)};
        candidates.count += codes_[packed + i] == code ? 1U : 0U;
      }
    }
    for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1] && clusters < kCandidates;
         ++i) {
      if (cluster_codes_[i] != code) continue;
      candidates.item[candidates.count++] = {link, static_cast<std::uint32_t>(i)};
      ++clusters;
    }
  }
}

SkinSensing::Surroundings SkinSensing::surroundings(workspace::Index3 at,
                                                    const workspace::Workspace& workspace) const noexcept {
  const Neighbourhood& near = *neighbourhood_;
  const kernel::ToVoxels shift{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {at.x + 0.5, at.y + 0.5, at.z + 0.5}};
  std::array<std::uint8_t, Neighbourhood::kMost> codes;
  kernel::look_up(
      kernel::field_of(workspace), shift,
      {near.x.data(), near.y.data(), near.z.data(), near.weight.data(), kernel::whole_groups(near.count)},
      codes.data(), nullptr);
  Surroundings around{0.0, Eigen::Vector3d::Zero()};
  for (std::size_t i = 0; i < near.count; ++i) {
    const auto mu = static_cast<double>(palette_[codes[i]]);
    around.mu += mu;
    around.gradient_W += mu * Eigen::Vector3d(near.x[i], near.y[i], near.z[i]);
  }
  return around;
}

/// Returns the voxel in which a sensor meets a code: its own or, for a cluster sensor, the nearest of its
/// zone.
std::optional<workspace::Index3> SkinSensing::place_of(std::size_t link, std::size_t sensor,
                                                       std::uint8_t code,
                                                       const workspace::Workspace& workspace) const noexcept {
  const workspace::Index3 centre = voxel_of(link, layout_->position(sensor));
  const std::uint8_t kind = layout_->cluster_kind[sensor];
  if (kind == 0) return centre;
  std::optional<workspace::Index3> nearest;
  int nearest_square = 0;
  const MutedObjects& list = muted_objects_[link];
  stencils_[kind - std::size_t{1}].for_each(centre, [&](workspace::Index3 voxel, double) {
    const int x = voxel.x - centre.x, y = voxel.y - centre.y, z = voxel.z - centre.z;
    const int square = x * x + y * y + z * z;
    if (nearest && square >= nearest_square) return;
    if (workspace.mu_code(voxel) != code || (list.count > 0 && list.has(workspace.object(voxel)))) return;
    nearest = voxel, nearest_square = square;
  });
  return nearest;
}

/// Returns the candidate that lies farthest in a direction.
std::size_t SkinSensing::farthest(const WorstCandidates& candidates, const Eigen::Vector3d& direction_W,
                                  const LinkPoses& X_WL) const noexcept {
  std::size_t best = 0;
  double most = -std::numeric_limits<double>::infinity(), origin = 0.0;
  std::uint32_t link = core::kMaxJoints + 1;
  Eigen::Vector3d direction_L = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < candidates.count; ++i) {
    if (const std::uint32_t of = candidates.item[i].link; of != link) {
      link = of;
      direction_L = X_WL[link].rotation.transpose() * direction_W;
      origin = X_WL[link].translation_m.dot(direction_W);
    }
    const double along = origin + direction_L.dot(layout_->position(candidates.item[i].sensor));
    if (along > most) most = along, best = i;
  }
  return best;
}

/// Reads the surroundings of a few of the sensors that meet the greatest code. Then follows the gradient:
/// reads those of the sensor that lies farthest uphill, and keeps the best of all.
void SkinSensing::find_worst(const LinkPoses& X_WL, const workspace::Workspace& workspace) noexcept {
  std::uint8_t greatest = 0;
  for (const std::uint8_t worst : block_worst_) greatest = std::max(greatest, worst);
  if (!layout_->clusters.empty()) {
    for (const std::uint8_t worst : cluster_codes_) greatest = std::max(greatest, worst);
  }
  if (greatest == 0) return;
  WorstCandidates candidates;
  find_worst_candidates(greatest, candidates);
  Surroundings best{-1.0, Eigen::Vector3d::Zero()};
  const auto look_at = [&](std::size_t i) {
    const auto [link, sensor] = candidates.item[i];
    const auto voxel = place_of(link, sensor, greatest, workspace);
    if (!voxel) return;
    const Surroundings around = surroundings(*voxel, workspace);
    if (around.mu <= best.mu) return;
    best = around;
    worst_ = {true,
              sensor,
              link,
              *voxel,
              X_WL[link] * layout_->position(sensor),
              workspace.palette()[greatest],
              workspace.order(*voxel),
              workspace.object(*voxel)};
  };
  const std::size_t stride = (candidates.count + kFirstSamples - 1) / kFirstSamples;
  for (std::size_t i = 0; i < candidates.count; i += stride) look_at(i);
  if (worst_.found && stride > 1) look_at(farthest(candidates, best.gradient_W, X_WL));
}

}  // namespace phantom::robot
