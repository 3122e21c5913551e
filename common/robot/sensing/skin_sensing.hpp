#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/robot/drag/drag.hpp"
#include "common/robot/drag/medium.hpp"
#include "common/robot/sensing/cluster_sensor.hpp"
#include "common/robot/sensing/place_speeds.hpp"
#include "common/robot/sensing/sensing_kernel.hpp"
#include "common/robot/sensing/viscosity_filter.hpp"
#include "common/robot/sensing/worker_team.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/workspace/aligned.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot {

/// Links of an arm, by index.
using LinkSet = std::bitset<core::kMaxJoints + 1>;
inline LinkSet all_links() noexcept { return LinkSet().set(); }

/// The sensor that meets the greatest μ. If several meet it, the sensor around which μ is greatest: that is
/// where the object is nearest, resolved more finely than by the layers. It is the worst of the links' worst
/// sensors, so links that are sensed apart give the same one.
struct WorstSensor {
  bool found = false;       ///< false: every sensor is in free space and the rest is meaningless
  std::size_t sensor = 0;   ///< index in the layout
  std::size_t link = 0;     ///< link that carries it
  workspace::Index3 voxel;  ///< its voxel; for a cluster sensor the nearest voxel of its zone with that μ
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  float mu = 0.0F;           ///< Pa·s/m
  std::int8_t order = 0;     ///< neighbour order of that voxel
  std::uint16_t object = 0;  ///< object whose fluid it is
  /// Whose voxel it is: 0 the workspace's, k + 1 that of the moving fluid k, whose grid `voxel` is in.
  std::size_t fluid = 0;
};

/// Fluid that moves with a body, such as a link of another arm: voxels in the body's frame.
struct MovingFluid {
  const workspace::Workspace* voxels = nullptr;
  geometry::Pose X_WB;  ///< of the body
};

struct SensingOptions {
  /// Also computes the sums of ∇μ for directional drag, by central differences over ± gradient_reach_vox
  /// voxels at the sensors that meet fluid. The reach should be a layer's thickness. μ is constant within a
  /// layer, so a shorter reach finds no gradient in the middle of a layer.
  bool gradient = false;
  int gradient_reach_vox = 4;
  MemoryWeights memory;    ///< smooths μ of point sensors along their path (table 4.2); empty: no smoothing
  ResponseCurve response;  ///< of cluster sensors
  /// Number of threads that share the work; 1: only the caller's. The results are the same, bit for bit, for
  /// any number. More threads than the host has cores do not help.
  std::size_t threads = 1;
  Medium medium;  ///< that fills the space around the objects
  /// Greatest number of moving fluids, at most SkinSensing::kMaxFluids; each takes some 80 bytes a sensor.
  std::size_t moving_fluids = 0;
};

/// Computes the sums of a whole skin in a workspace. Holds packed copies of the sensors and the scratch
/// memory of a tick; the layout and the workspace are constant. Sums are kept in doubles and agree with the
/// literal twin's to 1e-9 (relative).
///
/// The cost does not depend on the number of joints. A point sensor takes one gathered byte and ten sums, in
/// SIMD. Groups of 16 sensors wholly in free space need no sums, so a skin entirely in fluid takes up to half
/// as long again as one in free space; see also kernel::sense. With `gradient`, each sensor takes six more
/// bytes if its group of 16 meets fluid. A cluster sensor takes a byte for each voxel of its zone. Memory (5
/// scalar operations and a ring entry for each sensor) and muted contacts (one object look-up for each sensor
/// of that link in fluid) use a slower loop for the links they concern.
///
/// Where fluids that move with bodies meet the workspace's, or each other, a sensor is in the one of greatest
/// μ, and in none of the others: of equal ones in the workspace's, then in the first. (A cluster sensor: in
/// the one whose mean is greatest.) A link costs a look-up in each fluid whose box it reaches, and the slower
/// loop; what no fluid reaches costs nothing more.
class SkinSensing {
 public:
  /// The layout must outlive this object. Not real-time safe.
  SkinSensing(const SkinLayout& layout, const SensingOptions& options);
  ~SkinSensing();

  /// Senses the workspace with links 1 … `joint_count`. Results: sums(), medium(), active(), muted(),
  /// worst(). A link whose pose is not finite feels nothing. Real-time safe: yes.
  void sense(const LinkPoses& X_WL, std::size_t joint_count, const workspace::Workspace& workspace) noexcept {
    sense(X_WL, joint_count, workspace, all_links());
  }
  /// Likewise, of these links alone: the others feel nothing but the medium. `fluids`: at most
  /// options.moving_fluids; they must live until the next sense().
  void sense(const LinkPoses& X_WL, std::size_t joint_count, const workspace::Workspace& workspace,
             const LinkSet& links, std::span<const MovingFluid> fluids = {}) noexcept;
  /// Adds links to those of the last sense(), at the same poses in the same workspace. The results are those
  /// of sense() with all of these links, bit for bit. Real-time safe: yes.
  void sense_also(const LinkPoses& X_WL, std::size_t joint_count, const workspace::Workspace& workspace,
                  const LinkSet& links) noexcept;
  /// Weighs the worst sensor of links that another SkinSensing with the same layout has sensed, at the same
  /// poses in the same workspace, against worst(). Returns false, and changes nothing, if that sensor does
  /// not meet `mu` (Pa·s/m) here. Real-time safe: yes.
  bool consider(const LinkPoses& X_WL, const workspace::Workspace& workspace, std::size_t sensor,
                float mu) noexcept;

  /// Moves the sensors of a gripper's fingers to where they are when it is closed by `share`, 0 (at its
  /// widest, as at first) to 1. Cost: the blocks of 256 sensors that have such. Real-time safe: yes.
  void close_gripper(double share) noexcept;

  /// Mutes an object for a link (intended contact): the link no longer feels the object's fluid, until it is
  /// unmuted. A link can have at most kMaxMuted muted objects; returns false if there is no room. Real-time
  /// safe: yes.
  bool mute(std::size_t link, std::uint16_t object, bool muted) noexcept;
  static constexpr std::size_t kMaxMuted = 16;
  static constexpr std::size_t kMaxFluids = 64;
  /// Forgets the viscosities that sensors met before. Real-time safe: yes.
  void forget() noexcept;
  /// Gives the arm's own sensors, those of `own`, what they remember in `before`. Both must sense with the
  /// same options, and with layouts that hold `own` as skin_with_bodies() does. Other sensors remember
  /// nothing. Real-time safe: yes.
  void continue_from(const SkinSensing& before, const SkinLayout& own) noexcept;

  const LinkSums& sums() const noexcept { return sums_; }  ///< of the objects' fluid
  const MediumLinkSums& medium() const noexcept { return medium_.sums(); }
  /// Returns the part of sums() that comes from a moving fluid.
  const LinkSums& sums_in(std::size_t fluid) const noexcept { return fluid_sums_[fluid]; }
  /// Calls visit(link, sensor) for the sensors that met a code of at least `code`, above 0, and are not
  /// muted. Real-time safe: as visit is.
  template <class Visit>
  void for_each_in(std::uint8_t code, const Visit& visit) const noexcept {
    for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
      const std::size_t first = layout_->first[link], points = layout_->first_cluster[link] - first;
      for (std::size_t i = 0; i < points; ++i) {
        if (i % kernel::kBlock == 0 && block_worst_[first_block_[link] + i / kernel::kBlock] < code) {
          i += kernel::kBlock - 1;
          continue;
        }
        if (codes_[packed_first_[link] + i] >= code) visit(link, first + i);
      }
      for (std::size_t i = layout_->first_cluster[link]; i < layout_->first[link + 1]; ++i)
        if (cluster_codes_[i] >= code) visit(link, i);
    }
  }
  /// Calls visit(sensor, code) for sensors of a link that met fluid and are not muted, each once: some `most`
  /// evenly chosen, or all if they are fewer, and of the blocks that these are in the first one in its
  /// greatest code. Where blocks outnumber `most`, of so many evenly chosen blocks that first one alone. Of a
  /// moving fluid's: that of in_fluid(). Cost: as the sensors of its blocks in fluid, in steps. Real-time
  /// safe: as visit is.
  template <class Visit>
  void for_each_place(std::size_t link, std::size_t most, const Visit& visit) const noexcept;
  /// Calls visit(sensor, code) for the sensors of a link that met fluid, are not muted and may exceed the
  /// limit of their code; `more_m_s`: how much faster than the link they may be. Leaves out blocks of sensors
  /// near which is nothing but objects with is_known(object), which is asked before each block. Of more than
  /// `most` sensors that are left, so many evenly chosen. Cost: of a block's bounds, then of a comparison for
  /// each sensor. Of a moving fluid's: that of in_fluid(). Not for several threads at once. Real-time safe:
  /// as is_known and visit are.
  template <class IsKnown, class Visit>
  void for_each_exceeding(std::size_t link, const PlaceVelocity& velocity, double more_m_s,
                          const CodeSpeedLimits& limits, const workspace::Workspace& workspace,
                          std::size_t most, const IsKnown& is_known, const Visit& visit) noexcept;
  /// Returns what the skin has met in a moving fluid, by its index in the last sense().
  SkinSensing& in_fluid(std::size_t fluid) const noexcept { return *in_fluids_[fluid]; }
  /// Returns the voxel in which a sensor met a code: its own or, for a cluster sensor, the nearest of its
  /// zone. None: it did not meet it. Real-time safe: yes.
  std::optional<workspace::Index3> place_of(std::size_t link, std::size_t sensor, std::uint8_t code,
                                            const workspace::Workspace& workspace) const noexcept;
  std::size_t active() const noexcept { return active_; }  ///< sensors that meet fluid
  std::size_t muted() const noexcept { return muted_; }    ///< sensors in fluid that is muted for them
  const WorstSensor& worst() const noexcept { return worst_; }
  /// Returns the worst sensor of one link in the workspace's fluid; in that of in_fluid(): in its. It does
  /// not depend on the other links.
  const WorstSensor& worst_of(std::size_t link) const noexcept { return worst_of_links_[link]; }
  const SkinLayout& layout() const noexcept { return *layout_; }

 private:
  struct MutedObjects {
    std::array<std::uint16_t, kMaxMuted> object{};
    std::size_t count = 0;
    bool has(std::uint16_t id) const noexcept;
  };
  struct Totals;           // running sums
  struct Part;             // the sensors that one thread takes
  struct WorstCandidates;  // candidates for the worst sensor
  struct Neighbourhood;    // offsets of the voxels around a voxel
  /// The sum of μ around a voxel, which rises voxel by voxel towards the object, even within a layer; and the
  /// direction in which μ rises.
  struct Surroundings {
    double mu;
    Eigen::Vector3d gradient_W;
  };

  /// Packed sensors that lie in one block with sensors that move.
  struct MovingBlock {
    std::size_t block, first, sensors;
  };
  void measure(const MovingBlock& at) noexcept;
  static std::vector<Part> parts_of(const SkinLayout& layout);
  static std::shared_ptr<const Neighbourhood> make_neighbourhood(int reach_vox);
  kernel::Points points_of(std::size_t first, std::size_t end) const noexcept;
  std::size_t sensors_of(const Part& part) const noexcept;
  workspace::Index3 voxel_of(std::size_t link, const Eigen::Vector3d& p_L_m) const noexcept;
  void place_link(std::size_t link, const geometry::Pose& X_WL, const workspace::GridSpec& grid) noexcept;
  void sense_points(Part& part, const workspace::Workspace& workspace) noexcept;
  void look_up(Part& part, const workspace::Workspace& workspace) noexcept;
  void prevail(Part& part) noexcept;
  void add_looked_up(Part& part, const workspace::Workspace& workspace) noexcept;
  void note_worst(Part& part, const workspace::Workspace& workspace, const double* mu) noexcept;
  void sense_clusters(Part& part, const workspace::Workspace& workspace) noexcept;
  void add_cluster(Part& part, std::size_t sensor, const ClusterReading& reading,
                   const workspace::Workspace& workspace) noexcept;
  ClusterReading read_cluster(Part& part, const ClusterStencil& stencil, workspace::Index3 centre,
                              const workspace::Workspace& workspace) noexcept;
  void take(std::size_t link, const Totals& totals, const geometry::Pose& X_WL, double reference_m) noexcept;
  void start(const workspace::Workspace& workspace) noexcept;
  void enclose(const SkinLayout& layout) noexcept;
  /// The fluids that reach a link, as bits.
  using Fluids = std::bitset<kMaxFluids>;
  template <class IsKnown>
  bool is_near_known_only(std::size_t link, const Eigen::Vector3d& middle_L_m, double radius_m,
                          const workspace::Workspace& workspace, const IsKnown& is_known) const noexcept;
  bool reaches(const MovingFluid& fluid, std::size_t link, const geometry::Pose& X_WL) const noexcept;
  void place_in_fluids(std::size_t link, const geometry::Pose& X_WL) noexcept;
  void take_fluids(std::size_t link, Part& first) noexcept;
  void weigh_fluids(const LinkPoses& X_WL) noexcept;
  std::uint8_t greatest_code(std::size_t link) const noexcept;
  void find_worst_candidates(std::size_t link, std::uint8_t code, WorstCandidates& candidates) const noexcept;
  void find_worst(std::size_t link, const LinkPoses& X_WL, const workspace::Workspace& workspace) noexcept;
  /// A sensor that may be the worst: what it meets, where, and the sum of μ around it.
  struct Weighed {
    std::size_t link, sensor;
    std::uint8_t code;
    workspace::Index3 voxel;
    double around_mu;
  };
  void weigh(const Weighed& at, const LinkPoses& X_WL, const workspace::Workspace& workspace) noexcept;
  WorstSensor sensor_at(const Weighed& at, const LinkPoses& X_WL,
                        const workspace::Workspace& workspace) const noexcept;
  Surroundings surroundings(workspace::Index3 at, const workspace::Workspace& workspace) const noexcept;
  std::size_t farthest(const WorstCandidates& candidates, const Eigen::Vector3d& direction_L) const noexcept;

  const SkinLayout& open_;           // the layout with the gripper at its widest
  std::optional<SkinLayout> moved_;  // as it is now, if it has sensors that move
  const SkinLayout* layout_;         // the one that holds
  std::vector<std::size_t> moving_;  // sensors of the layout that move
  std::vector<MovingBlock> moving_blocks_;
  double closed_ = 0.0;  // share by which the gripper is closed in it
  SensingOptions options_;
  std::vector<ClusterStencil> stencils_;  // for each kind of cluster
  std::optional<ViscosityFilter> memory_;

  // Point sensors, link by link in whole groups (kernel::kGroup).
  std::array<std::size_t, core::kMaxJoints + 2> packed_first_{};
  workspace::AlignedVector<double> x_m_, y_m_, z_m_, weight_;
  // Positions relative to the centres of their blocks (of kernel::kBlock sensors, link by link).
  std::array<std::size_t, core::kMaxJoints + 1> first_block_{};
  std::vector<kernel::Block> blocks_;
  workspace::AlignedVector<std::int32_t> x_steps_, y_steps_, z_steps_;
  workspace::AlignedVector<std::uint8_t> codes_;    // of this tick
  workspace::AlignedVector<std::uint32_t> voxels_;  // only with memory
  workspace::AlignedVector<double> mu_;             // only with memory or muted objects
  std::vector<std::uint8_t> block_worst_;    // greatest code of each block of kernel::kBlock packed sensors
  std::vector<std::uint8_t> block_fast_;     // whether a sensor of the block may exceed its limit
  std::vector<std::uint8_t> cluster_codes_;  // greatest code of each cluster sensor, by sensor index
  std::shared_ptr<const Neighbourhood> neighbourhood_;
  std::vector<Part> parts_;  // link by link
  WorkerTeam team_;

  std::array<MutedObjects, core::kMaxJoints + 1> muted_objects_{};
  std::array<kernel::ToVoxels, core::kMaxJoints + 1> to_voxels_{};
  std::array<float, 256> palette_{};
  ResponseTable response_{};
  LinkSums sums_;
  MediumSensing medium_;
  std::size_t active_ = 0, muted_ = 0;
  WorstSensor worst_;
  std::array<WorstSensor, core::kMaxJoints + 1> worst_of_links_;
  // What the skin feels in each moving fluid, in its frame; the same layout, without fluids of its own.
  std::vector<std::unique_ptr<SkinSensing>> in_fluids_;
  std::vector<LinkSums> fluid_sums_;
  std::span<const MovingFluid> fluids_;  // of this tick
  std::array<Fluids, core::kMaxJoints + 1> reached_by_{};
  std::array<Eigen::Vector3d, core::kMaxJoints + 1> middle_m_{};  // of each link's sensors, and how
  std::array<double, core::kMaxJoints + 1> radius_m_{};           // far they reach from it
  LinkPoses X_BL_;                                                // of the links, in the fluid's frame
  std::uint8_t worst_code_ = 0;                                   // of worst_, and the sum of μ around it
  double worst_around_mu_ = 0.0;
};

template <class Visit>
void SkinSensing::for_each_place(std::size_t link, std::size_t most, const Visit& visit) const noexcept {
  const std::size_t first = layout_->first[link], first_cluster = layout_->first_cluster[link];
  const std::size_t points = first_cluster - first, clusters = layout_->first[link + 1] - first_cluster;
  const std::size_t blocks = (points + kernel::kBlock - 1) / kernel::kBlock;
  const std::uint8_t* const worst = block_worst_.data() + first_block_[link];
  const auto in_fluid = blocks - static_cast<std::size_t>(std::count(worst, worst + blocks, std::uint8_t{0}));
  const std::size_t stride =
      std::max<std::size_t>(1, (in_fluid * kernel::kBlock + clusters + most - 1) / most);
  std::size_t next = stride / 2;  // sensor of the blocks in fluid that is taken next
  for (std::size_t block = 0; block < blocks; ++block) {
    if (worst[block] == 0) continue;
    if (next >= kernel::kBlock) {
      next -= kernel::kBlock;
      continue;
    }
    const std::size_t begin = block * kernel::kBlock, count = std::min(kernel::kBlock, points - begin);
    const std::uint8_t* const codes = codes_.data() + packed_first_[link] + begin;
    const void* const found = std::memchr(codes, worst[block], count);
    const auto thickest =
        found == nullptr ? count : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - codes);
    if (thickest < count) visit(first + begin + thickest, worst[block]);
    for (; next < kernel::kBlock; next += stride)
      if (stride < kernel::kBlock && next < count && codes[next] != 0 && next != thickest)
        visit(first + begin + next, codes[next]);
    next -= kernel::kBlock;
  }
  for (std::size_t i = first_cluster; i < first_cluster + clusters; i += stride)
    if (cluster_codes_[i] != 0) visit(i, cluster_codes_[i]);
}

/// Returns whether all fluid in a sphere is that of known objects, as far as the bricks tell.
template <class IsKnown>
bool SkinSensing::is_near_known_only(std::size_t link, const Eigen::Vector3d& middle_L_m, double radius_m,
                                     const workspace::Workspace& workspace,
                                     const IsKnown& is_known) const noexcept {
  constexpr int kMaxBricks = 64;
  const kernel::ToVoxels& to = to_voxels_[link];
  std::array<std::int32_t, 3> low{}, high{};
  int bricks = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Map<const Eigen::Vector3d> row(to.r + 3 * k);
    const double middle_vox = row.dot(middle_L_m) + to.t[k], reach_vox = row.norm() * radius_m + 1.0;
    const std::int32_t last = workspace.size_bricks()[k] - 1;
    const auto brick_at = [&](double vox) {
      return static_cast<std::int32_t>(
          std::clamp(std::floor(vox / workspace::kBrickEdge), 0.0, static_cast<double>(last)));
    };
    low[k] = brick_at(middle_vox - reach_vox), high[k] = brick_at(middle_vox + reach_vox);
    bricks *= high[k] - low[k] + 1;
  }
  if (bricks > kMaxBricks) return false;
  for (std::int32_t z = low[2]; z <= high[2]; ++z)
    for (std::int32_t y = low[1]; y <= high[1]; ++y)
      for (std::int32_t x = low[0]; x <= high[0]; ++x) {
        if (!workspace.has_brick({x, y, z})) continue;
        const auto brick = workspace.brick({x, y, z});
        if (brick.object != nullptr || !is_known(brick.sole_object)) return false;
      }
  return true;
}

template <class IsKnown, class Visit>
void SkinSensing::for_each_exceeding(std::size_t link, const PlaceVelocity& velocity, double more_m_s,
                                     const CodeSpeedLimits& limits, const workspace::Workspace& workspace,
                                     std::size_t most, const IsKnown& is_known, const Visit& visit) noexcept {
  const std::size_t first = layout_->first[link], first_cluster = layout_->first_cluster[link];
  const std::size_t points = first_cluster - first, clusters = layout_->first[link + 1] - first_cluster;
  const std::size_t blocks = (points + kernel::kBlock - 1) / kernel::kBlock;
  // The zones of cluster sensors reach farther than the sensors.
  if (clusters == 0 && is_near_known_only(link, middle_m_[link], radius_m_[link], workspace, is_known))
    return;
  const kernel::Block* const bounds = blocks_.data() + first_block_[link];
  std::size_t left = clusters;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::uint8_t worst = block_worst_[first_block_[link] + block];
    const auto is_fast = [&] {
      const Eigen::Map<const Eigen::Vector3d> centre_m(bounds[block].centre_m);
      return !limits.none_exceeds(worst,
                                  velocity.greatest_within(centre_m, bounds[block].radius_m) + more_m_s);
    };
    const bool fast = worst != 0 && is_fast();
    block_fast_[first_block_[link] + block] = fast ? 1 : 0;
    left += fast ? kernel::kBlock : 0;
  }
  const std::size_t stride = std::max<std::size_t>(1, (left + most - 1) / most);
  for (std::size_t block = 0; block < blocks; ++block) {
    if (block_fast_[first_block_[link] + block] == 0) continue;
    const Eigen::Vector3d centre_m(bounds[block].centre_m);
    if (is_near_known_only(link, centre_m, bounds[block].radius_m, workspace, is_known)) continue;
    const std::size_t begin = block * kernel::kBlock, count = std::min(kernel::kBlock, points - begin);
    const std::size_t packed = packed_first_[link] + begin;
    const double greatest_m_s = velocity.greatest_within(centre_m, bounds[block].radius_m) + more_m_s;
    for (std::size_t i = 0; i < count; i += stride) {
      const std::uint8_t code = codes_[packed + i];
      if (code == 0 || limits.holds(code, greatest_m_s)) continue;
      const Eigen::Vector3d p_L_m(x_m_[packed + i], y_m_[packed + i], z_m_[packed + i]);
      if (limits.exceeds(code, velocity.at(p_L_m).squaredNorm(), more_m_s)) visit(first + begin + i, code);
    }
  }
  for (std::size_t i = first_cluster; i < first_cluster + clusters; i += stride)
    if (cluster_codes_[i] != 0) visit(i, cluster_codes_[i]);
}

}  // namespace phantom::robot
