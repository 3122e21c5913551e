#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/robot/skin/skin.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot {

/// Returns the fraction, 0…1, of the voxel at offset (x,y,z), in voxels, that lies inside the sphere of
/// radius `radius_vox` around the centre of the voxel at (0,0,0). The radius counts in the voxels' shortest
/// side, `stretch` is VoxelSize::stretch(). Accurate to about 1e-9.
double fraction_in_sphere(int x, int y, int z, double radius_vox,
                          const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones());

/// Maps the μ that a cluster sensor reads to its response (the thesis's response shaper). Interpolates
/// linearly between the points and is constant before the first and after the last. Without points it returns
/// μ itself.
class ResponseCurve {
 public:
  ResponseCurve() = default;
  /// Takes points (μ, response), both in Pa·s/m, with μ strictly rising and response ≥ 0. Throws
  /// std::invalid_argument otherwise.
  explicit ResponseCurve(std::vector<std::pair<double, double>> points);
  double operator()(double mu) const noexcept;

 private:
  std::vector<std::pair<double, double>> points_;
};

/// Response for each μ code.
using ResponseTable = std::array<double, 256>;
/// Fills `table` with the response to each code's μ in `palette`. Real-time safe: yes.
void fill_response(const ResponseCurve& curve, const std::vector<float>& palette,
                   ResponseTable& table) noexcept;

/// What a cluster sensor reads at one position.
struct ClusterReading {
  double mean = 0.0;          ///< Σ(SLA·SSA) / ΣSSA; times the speed it is the thesis's F_r (eq. 6.1)
  std::uint8_t greatest = 0;  ///< greatest code among the voxels that count
};

/// The zone of a cluster sensor: which voxels count, and with what weight. Constant after construction.
/// The zone is as wide in metres along every axis, to the nearest voxel: m counts in the voxels' shortest
/// side, and a voxel of a binary shape counts where its centre is inside. So along a side of more than m
/// shortest sides (cube, sphere) only the middle voxel is left; kFraction also weighs what the sphere cuts.
class ClusterStencil {
 public:
  /// `stretch`: VoxelSize::stretch() of the workspaces that are read.
  explicit ClusterStencil(const ClusterSpec& spec, const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones());

  std::size_t voxel_count() const noexcept { return voxels_; }  ///< voxels that count
  double total_weight() const noexcept { return total_; }       ///< ΣSSA
  /// Reads the zone around voxel `centre`. Voxels outside the grid are free space. Real-time safe: yes.
  ///
  /// Cost of a binary shape: one SIMD comparison of each tile of 4³ voxels that the zone touches with each
  /// code of the palette. A weighted shape, a palette of more than kMaxCounted codes or a zone that reaches
  /// over the grid's border costs more: a look-up for each voxel.
  ClusterReading read(const workspace::Workspace& workspace, workspace::Index3 centre,
                      const ResponseTable& response) const noexcept;
  /// Calls visit(voxel, weight) for each voxel that counts.
  template <class Visit>
  void for_each(workspace::Index3 centre, Visit&& visit) const {
    for (const Row& row : rows_) {
      for (int x = -row.reach; x <= row.reach; ++x) {
        visit(workspace::Index3{centre.x + x, centre.y + row.y, centre.z + row.z}, weight(row, x));
      }
    }
  }

 private:
  /// Voxels −reach…reach along x at offset (y, z).
  struct Row {
    int y, z, reach;
    std::size_t first_weight;
  };
  double weight(const Row& row, int x) const noexcept {
    return weights_.empty() ? 1.0 : weights_[row.first_weight + static_cast<std::size_t>(x + row.reach)];
  }
  static constexpr std::size_t kMaxCounted = 32;
  struct Bricks;  // the bricks that a zone inside the grid lies in
  /// Number of tiles along an axis that a zone touches if its lowest voxel is voxel `place` (0…3) of its
  /// tile.
  static int tiles_along(int place, int reach) noexcept { return (place + 2 * reach) / 4 + 1; }
  void mask_tiles();
  ClusterReading count_inside(const workspace::Workspace& workspace, workspace::Index3 centre,
                              const ResponseTable& response) const noexcept;

  workspace::Index3 reach_;  // farthest voxel that counts, along each axis
  std::vector<Row> rows_;
  std::vector<double> weights_;  // of all rows; empty if all weights are 1
  /// For each position of the zone's lowest voxel in its tile: the voxels of each tile that count, one bit
  /// each.
  std::array<std::vector<std::uint64_t>, 64> tile_masks_;
  std::size_t voxels_ = 0;
  double total_ = 0.0;
};

}  // namespace phantom::robot
