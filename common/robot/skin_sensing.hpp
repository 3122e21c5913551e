#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/robot/aligned.hpp"
#include "common/robot/cluster_sensor.hpp"
#include "common/robot/drag.hpp"
#include "common/robot/mu_memory.hpp"
#include "common/robot/sensing_kernel.hpp"
#include "common/robot/skin.hpp"
#include "common/robot/worker_team.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot {

/// The sensor that meets the greatest μ. Among several of that μ, the one in whose surroundings μ is
/// greatest: that is where the object is nearest, finer than the layers tell.
struct WorstSensor {
  bool found = false;       ///< false: every sensor is in free space; the rest is then meaningless
  std::size_t sensor = 0;   ///< index in the layout
  std::size_t link = 0;     ///< link that carries it
  workspace::Index3 voxel;  ///< where it is; for a cluster sensor the nearest voxel of its zone with that μ
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  float mu = 0.0F;           ///< Pa·s/m
  std::int8_t order = 0;     ///< neighbour order of that voxel
  std::uint16_t object = 0;  ///< object whose fluid it is
};

struct SensingOptions {
  /// Also take the sums of ∇μ (for directional drag): central differences over ± gradient_reach_vox voxels,
  /// on sensors that meet fluid. The reach should be a layer's thickness: μ is constant within a layer, and a
  /// shorter one sees no gradient in a layer's middle.
  bool gradient = false;
  int gradient_reach_vox = 4;
  MemoryWeights memory;    ///< smooths μ of point sensors along their way (table 4.2); empty: not
  ResponseCurve response;  ///< of cluster sensors
  /// That share the sensors; 1: the caller's alone. The results are the same, bit for bit, with any number.
  /// More than the host has cores is of no use.
  std::size_t threads = 1;
};

/// Takes the sums of a whole skin against a workspace. Holds the scratch memory of a tick and packed copies
/// of the sensors; the layout and the workspace are constant. Sums are kept in doubles: they agree with the
/// literal ones to 1e-9 (relative).
///
/// Cost, whatever the number of joints: for a point sensor one byte gathered and ten sums, in SIMD (groups of
/// 16 in free space alone need no sums: a skin all in fluid takes up to half as long again as one in none;
/// see also kernel::sense); with `gradient` six more bytes for each group of 16 sensors of which one meets
/// fluid; for a cluster sensor a byte for each voxel of its zone. Memory (5 scalar operations and a ring
/// entry a sensor) and muted contacts (one object looked up for each sensor of that link in fluid) leave the
/// fast loop for the link they concern.
class SkinSensing {
 public:
  /// The layout outlives this. Not real-time safe.
  SkinSensing(const SkinLayout& layout, const SensingOptions& options);
  ~SkinSensing();

  /// Real-time safe: yes. Results: sums(), active(), muted(), worst(). `joint_count` moving links are sensed;
  /// a link whose pose is not finite feels nothing.
  void sense(const LinkPoses& X_WL, std::size_t joint_count, const workspace::Workspace& workspace) noexcept;

  /// Intended contact: from now on a link does not feel the fluid of an object (or feels it again). At most
  /// kMostMuted objects a link; false if there is no room. Real-time safe: yes.
  bool mute(std::size_t link, std::uint16_t object, bool muted) noexcept;
  static constexpr std::size_t kMostMuted = 16;
  /// Forgets which viscosities sensors came through. Real-time safe: yes.
  void forget() noexcept;

  const LinkSums& sums() const noexcept { return sums_; }
  std::size_t active() const noexcept { return active_; }  ///< sensors that meet fluid
  std::size_t muted() const noexcept { return muted_; }    ///< sensors that meet fluid they must not feel
  const WorstSensor& worst() const noexcept { return worst_; }
  const SkinLayout& layout() const noexcept { return *layout_; }

 private:
  struct MutedObjects {
    std::array<std::uint16_t, kMostMuted> object{};
    std::size_t count = 0;
    bool has(std::uint16_t id) const noexcept;
  };
  struct Totals;           // sums at work
  struct Part;             // sensors for one thread to take
  struct WorstCandidates;  // candidates for the worst sensor
  struct Neighbourhood;    // voxels around one
  /// Sum of μ on the neighbourhood of a voxel, which rises voxel by voxel towards the object, also within a
  /// layer; and the way it rises.
  struct Surroundings {
    double mu;
    Eigen::Vector3d uphill_W;
  };

  static std::vector<Part> parts_of(const SkinLayout& layout);
  static std::shared_ptr<const Neighbourhood> make_neighbourhood(int reach_vox);
  kernel::Points points_of(std::size_t first, std::size_t end) const noexcept;
  std::size_t sensors_of(const Part& part) const noexcept;
  workspace::Index3 voxel_of(std::size_t link, const Eigen::Vector3d& p_L_m) const noexcept;
  void place_link(std::size_t link, const geometry::Pose& X_WL, const workspace::GridSpec& grid) noexcept;
  void sense_points(Part& part, const workspace::Workspace& workspace) noexcept;
  void sense_slowly(Part& part, const kernel::Points& points, const kernel::Field& field,
                    const workspace::Workspace& workspace) noexcept;
  void sense_clusters(Part& part, const workspace::Workspace& workspace) noexcept;
  ClusterReading read_cluster(Part& part, const ClusterStencil& stencil, workspace::Index3 centre,
                              const workspace::Workspace& workspace) noexcept;
  void take(std::size_t link, const Totals& totals, const geometry::Pose& X_WL, double voxel_size_m) noexcept;
  void find_worst_candidates(std::uint8_t code, WorstCandidates& candidates) const noexcept;
  void find_worst(const LinkPoses& X_WL, const workspace::Workspace& workspace) noexcept;
  Surroundings surroundings(workspace::Index3 at, const workspace::Workspace& workspace) const noexcept;
  std::size_t farthest(const WorstCandidates& candidates, const Eigen::Vector3d& direction_W,
                       const LinkPoses& X_WL) const noexcept;
  std::optional<workspace::Index3> place_of(std::size_t link, std::size_t sensor, std::uint8_t code,
                                            const workspace::Workspace& workspace) const noexcept;

  const SkinLayout* layout_;
  SensingOptions options_;
  std::vector<ClusterStencil> stencils_;  // by cluster kind
  std::optional<MuMemory> memory_;

  // Point sensors, link by link in whole groups (kernel::kGroup).
  std::array<std::size_t, core::kMaxJoints + 2> packed_first_{};
  AlignedVector<double> x_m_, y_m_, z_m_, weight_;
  // The same from the centres of their blocks (of kernel::kBlock sensors, link by link).
  std::array<std::size_t, core::kMaxJoints + 1> first_block_{};
  std::vector<kernel::Block> blocks_;
  AlignedVector<std::int32_t> x_steps_, y_steps_, z_steps_;
  AlignedVector<std::uint8_t> codes_;        // this tick
  AlignedVector<std::uint32_t> voxels_;      // with memory
  AlignedVector<double> mu_;                 // with memory or muted objects
  std::vector<std::uint8_t> block_worst_;    // greatest code of each kernel::kBlock packed sensors
  std::vector<std::uint8_t> cluster_codes_;  // greatest code of each cluster sensor, by sensor
  std::shared_ptr<const Neighbourhood> neighbourhood_;
  std::vector<Part> parts_;  // link by link
  WorkerTeam team_;

  std::array<MutedObjects, core::kMaxJoints + 1> muted_objects_{};
  std::array<kernel::ToVoxels, core::kMaxJoints + 1> to_voxels_{};
  std::array<float, 256> palette_{};
  ResponseTable response_{};
  LinkSums sums_;
  std::size_t active_ = 0, muted_ = 0;
  WorstSensor worst_;
};

}  // namespace phantom::robot
