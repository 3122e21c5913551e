// Finds the sensor that the percept reports: the one in the greatest μ or, of several, the nearest to the
// object. Each link has its worst sensor; the arm's is the worst of those.
#include <algorithm>
#include <limits>

#include "common/robot/sensing/skin_sensing.hpp"

namespace phantom::robot {
namespace {

/// Greatest number of blocks of points, and of cluster sensors, from which candidates are taken.
constexpr std::size_t kCandidates = 8;
/// Number of candidates, evenly chosen, whose surroundings are read first.
constexpr std::size_t kFirstSamples = 3;

}  // namespace

/// Steps of 1…reach voxels along the axes and the space diagonals, as points to look up.
struct SkinSensing::Neighbourhood {
  static constexpr int kMaxReach_vox = 16;
  static constexpr std::size_t kMax = kernel::whole_groups(14 * kMaxReach_vox);
  alignas(64) std::array<double, kMax> x{}, y{}, z{}, weight{};
  std::size_t count = 0;

  explicit Neighbourhood(int reach) {
    for (int direction = 0; direction < 27; ++direction) {
      const int dx = direction % 3 - 1, dy = direction / 3 % 3 - 1, dz = direction / 9 - 1;
      const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
      if (axes != 1 && axes != 3) continue;
      for (int step = 1; step <= std::min(reach, kMaxReach_vox); ++step, ++count)
        x[count] = step * dx, y[count] = step * dy, z[count] = step * dz;
    }
  }
};

std::shared_ptr<const SkinSensing::Neighbourhood> SkinSensing::make_neighbourhood(int reach_vox) {
  return std::make_shared<const Neighbourhood>(reach_vox);
}

/// Sensors of one link that meet a given code, collected one after another.
struct SkinSensing::WorstCandidates {
  static constexpr std::size_t kMax = kCandidates * (kernel::kBlock + 1);
  std::array<std::uint32_t, kMax> sensor;
  std::size_t count = 0;
};

/// Returns the greatest code that a link's sensors meet.
std::uint8_t SkinSensing::greatest_code(std::size_t link) const noexcept {
  std::uint8_t greatest = 0;
  const std::size_t points = layout_->first_cluster[link] - layout_->first[link];
  const std::size_t blocks = (points + kernel::kBlock - 1) / kernel::kBlock;
  for (std::size_t i = 0; i < blocks; ++i)
    greatest = std::max(greatest, block_worst_[first_block_[link] + i]);
  for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1]; ++i)
    greatest = std::max(greatest, cluster_codes_[i]);
  return greatest;
}

/// Finds sensors of a link that meet `code`: those in at most kCandidates blocks of points, evenly chosen
/// among the blocks that hold it, and as many clusters.
void SkinSensing::find_worst_candidates(std::size_t link, std::uint8_t code,
                                        WorstCandidates& candidates) const noexcept {
  const std::size_t packed = packed_first_[link], first_sensor = layout_->first[link],
                    points = layout_->first_cluster[link] - first_sensor;
  const auto worst = block_worst_.begin() + static_cast<std::ptrdiff_t>(first_block_[link]);
  const std::size_t blocks = (points + kernel::kBlock - 1) / kernel::kBlock;
  const auto holders =
      static_cast<std::size_t>(std::count(worst, worst + static_cast<std::ptrdiff_t>(blocks), code));
  const std::size_t stride = std::max<std::size_t>(1, (holders + kCandidates - 1) / kCandidates);
  std::size_t holder = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    if (block_worst_[first_block_[link] + block] != code || holder++ % stride != 0) continue;
    const std::size_t end = std::min((block + 1) * kernel::kBlock, points);
    for (std::size_t i = block * kernel::kBlock; i < end; ++i) {
      // without a branch on the code: always written, kept only if it holds
      candidates.sensor[candidates.count] = static_cast<std::uint32_t>(first_sensor + i);
      candidates.count += codes_[packed + i] == code ? 1U : 0U;
    }
  }
  std::size_t clusters = 0;
  for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1] && clusters < kCandidates;
       ++i) {
    if (cluster_codes_[i] != code) continue;
    candidates.sensor[candidates.count++] = static_cast<std::uint32_t>(i);
    ++clusters;
  }
}

SkinSensing::Surroundings SkinSensing::surroundings(workspace::Index3 at,
                                                    const workspace::Workspace& workspace) const noexcept {
  const Neighbourhood& near = *neighbourhood_;
  const kernel::ToVoxels shift{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {at.x + 0.5, at.y + 0.5, at.z + 0.5}};
  std::array<std::uint8_t, Neighbourhood::kMax> codes;
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
  around.gradient_W = around.gradient_W.cwiseProduct(workspace.grid().voxel_size_m.stretch());
  return around;
}

std::optional<workspace::Index3> SkinSensing::place_of(std::size_t link, std::size_t sensor,
                                                       std::uint8_t code,
                                                       const workspace::Workspace& workspace) const noexcept {
  const workspace::Index3 centre = voxel_of(link, layout_->position(sensor));
  const std::uint8_t kind = layout_->cluster_kind[sensor];
  if (kind == 0) return centre;
  std::optional<workspace::Index3> nearest;
  double nearest_square = 0.0;
  const Eigen::Vector3d stretch = workspace.grid().voxel_size_m.stretch();
  const MutedObjects& list = muted_objects_[link];
  stencils_[kind - std::size_t{1}].for_each(centre, [&](workspace::Index3 voxel, double) {
    const double square = workspace::vector(voxel - centre).cwiseProduct(stretch).squaredNorm();
    if (nearest && square >= nearest_square) return;
    if (workspace.mu_code(voxel) != code || (list.count > 0 && list.has(workspace.object(voxel)))) return;
    nearest = voxel, nearest_square = square;
  });
  return nearest;
}

/// Returns the candidate that lies farthest in a direction of its link's frame.
std::size_t SkinSensing::farthest(const WorstCandidates& candidates,
                                  const Eigen::Vector3d& direction_L) const noexcept {
  std::size_t best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < candidates.count; ++i) {
    const double along = direction_L.dot(layout_->position(candidates.sensor[i]));
    if (along > most) most = along, best = i;
  }
  return best;
}

/// Takes a sensor for the worst if it is worse than the worst so far. Among equals it is the first link's.
void SkinSensing::weigh(const Weighed& at, const LinkPoses& X_WL,
                        const workspace::Workspace& workspace) noexcept {
  const bool worse = at.code != worst_code_ ? at.code > worst_code_
                                            : at.around_mu > worst_around_mu_ ||
                                                  (at.around_mu == worst_around_mu_ && at.link < worst_.link);
  if (!worse) return;
  worst_code_ = at.code;
  worst_around_mu_ = at.around_mu;
  worst_ = sensor_at(at, X_WL, workspace);
}

WorstSensor SkinSensing::sensor_at(const Weighed& at, const LinkPoses& X_WL,
                                   const workspace::Workspace& workspace) const noexcept {
  return {true,
          at.sensor,
          at.link,
          at.voxel,
          X_WL[at.link] * layout_->position(at.sensor),
          workspace.palette()[at.code],
          workspace.order(at.voxel),
          workspace.object(at.voxel)};
}

/// Reads the surroundings of a few of a link's sensors that meet its greatest code. Then follows the
/// gradient: reads those of the sensor that lies farthest uphill, and weighs the best of all.
void SkinSensing::find_worst(std::size_t link, const LinkPoses& X_WL,
                             const workspace::Workspace& workspace) noexcept {
  const std::uint8_t greatest = greatest_code(link);
  if (greatest == 0) return;
  WorstCandidates candidates;
  find_worst_candidates(link, greatest, candidates);
  Surroundings best{-1.0, Eigen::Vector3d::Zero()};
  Weighed found{};
  const auto look_at = [&](std::size_t i) {
    const std::size_t sensor = candidates.sensor[i];
    const auto voxel = place_of(link, sensor, greatest, workspace);
    if (!voxel) return;
    const Surroundings around = surroundings(*voxel, workspace);
    if (around.mu <= best.mu) return;
    best = around;
    found = {link, sensor, greatest, *voxel, around.mu};
  };
  const std::size_t stride = (candidates.count + kFirstSamples - 1) / kFirstSamples;
  for (std::size_t i = 0; i < candidates.count; i += stride) look_at(i);
  if (best.mu < 0.0) return;
  if (stride > 1) look_at(farthest(candidates, X_WL[link].rotation.transpose() * best.gradient_W));
  worst_of_links_[link] = sensor_at(found, X_WL, workspace);
  weigh(found, X_WL, workspace);
}

}  // namespace phantom::robot
