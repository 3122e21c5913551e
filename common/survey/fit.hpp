#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/core/status.hpp"
#include "common/survey/measurement.hpp"
#include "common/survey/part.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::survey {

/// For each measured node, the node of the part that it is: index into PartModel::nodes_O_m, or kNotMapped.
/// One entry for each of Measurement::nodes.
using NodeMap = std::vector<std::uint32_t>;
inline constexpr std::uint32_t kNotMapped = UINT32_MAX;

/// Fits a part in the thesis's four steps (A.1.2, A.3.2), for a face that is already associated (step i).
/// Step ii turns the part so that the face's normal is the measured one, that of `triangle` (three of the
/// face's corners, by index in the face). Step iii spins it about that normal until the edges are parallel
/// (least squares; long edges count more). Step iv shifts it so that the corner `anchor` (by index in the
/// face) lies where it was measured. `face` needs three corners.
geometry::Pose fit_four_steps(const PartModel& part, const Measurement& measurement, const MeasuredFace& face,
                              const NodeMap& map, const CornerTriangle& triangle, std::size_t anchor);

/// Returns the corner of a face to use as anchor: the one with the smallest error.
std::size_t best_anchor(const Measurement& measurement, const MeasuredFace& face);

/// A pose and its uncertainty. The true pose is X_WO after a small turn θ about `centre_W_m` and a small
/// shift d. The errors (θ, d) have this covariance (rad, m; W axes).
struct PoseFit {
  geometry::Pose X_WO;
  Eigen::Vector3d centre_W_m = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Measured less fitted position, for each mapped node in the measurement's order.
  std::vector<Eigen::Vector3d> residual_W_m;
  std::vector<std::size_t> nodes;  ///< the mapped nodes, by index in the measurement
  double chi2 = 0.0;               ///< sum of squared residuals in units of their errors
  int degrees = 0;                 ///< 3 per node, less 6
  double probability() const { return degrees > 0 ? chi_square_tail(chi2, degrees) : 1.0; }
  double position_sigma_m() const;       ///< √ of the greatest variance of the shift along any direction
  double orientation_sigma_rad() const;  ///< √ of the greatest variance of the turn about any axis
};

/// Returns the rotation and shift that bring points `from` nearest to points `to`, all with equal weight
/// (Kabsch). The result is unique only for three or more points not in line.
geometry::Pose rigid_fit(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to);

/// Fits the pose to all mapped nodes by least squares, each weighted by its covariance (Gauss–Newton on the
/// pose), from `start`. Refuses nodes that do not determine the pose: fewer than three, or in line. Not
/// real-time safe.
core::Expected<PoseFit> refine(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                               const geometry::Pose& start);

/// Returns the covariance of a fitted pose's error (θ, d) by the head's mounting alone: the part turns and
/// shifts with all that was measured.
Eigen::Matrix<double, 6, 6> mounting_covariance_of(const PoseFit& fit, const Measurement& measurement);

/// Returns ∂(displacement of a point that moves with the part)/∂(θ, d), for a point given in W at the fitted
/// pose.
Eigen::Matrix<double, 3, 6> displacement_jacobian(const PoseFit& fit, const Eigen::Vector3d& p_W_m);

/// Returns the bound, in m, that with probability `confidence` no point of the part exceeds in its distance
/// from the fitted model. Draws random poses from the fit's covariance, the same ones at each call, and errs
/// on the safe side of that sample.
double worst_displacement_m(const PartModel& part, const PoseFit& fit, double confidence);

/// Returns the same for a known true pose: the greatest distance of a point of the part from its position in
/// the model.
double displacement_between_m(const PartModel& part, const geometry::Pose& model_WO,
                              const geometry::Pose& true_WO);

/// Returns the number of guard voxels that cover a displacement along an axis (A.5.2), rounded up. They count
/// in reference lengths (workspace::VoxelSize); along a longer side they reach the centre of the last voxel
/// into which the displacement carries.
int guard_voxels(double displacement_m, const workspace::VoxelSize& voxel_size_m);

/// A node without which the other nodes would fit: its range is probably wrong.
struct Misfit {
  std::size_t node = 0;           ///< index into Measurement::nodes
  double off_m = 0.0;             ///< distance from its position in the fit of the others
  double along_beam_m = 0.0;      ///< the part of it along the beam: too long (+) or too short (−)
  double rest_probability = 0.0;  ///< of the fit of the others
};
/// Leaves out each node in turn and returns those without which the rest fits, the likeliest first. Empty if
/// there is none.
std::vector<Misfit> find_misfits(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                                 const PoseFit& fit, double least_probability);

}  // namespace phantom::survey
