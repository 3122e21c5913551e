#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/core/status.hpp"
#include "common/survey/measurement.hpp"
#include "common/survey/part.hpp"

namespace phantom::survey {

/// Which node of the part each measured node is: indices into PartModel::nodes_O_m, one per
/// Measurement::nodes.
using NodeMap = std::vector<std::uint32_t>;
inline constexpr std::uint32_t kNotMapped = UINT32_MAX;

/// The thesis's fit in four steps (A.1.2, A.3.2), for a face that is already associated (step i): ii) turn
/// the part so that the face's normal is the measured one, that of `triangle` (three of the face's corners,
/// by their place in it); iii) spin about that normal until the edges are parallel (least squares, long edges
/// count more); iv) shift, so that the corner `anchor` (by its place in the face) lies where it was measured.
/// `face` needs three corners.
geometry::Pose fit_four_steps(const PartModel& part, const Measurement& measurement, const MeasuredFace& face,
                              const NodeMap& map, const CornerTriangle& triangle, std::size_t anchor);

/// The corner of a face to shift by: that with the smallest error.
std::size_t best_anchor(const Measurement& measurement, const MeasuredFace& face);

/// A pose and how well it is known. The true pose is X_WO after a small turn θ about `centre_W_m` and a small
/// shift d; the errors (θ, d) have this covariance (rad, m; W axes).
struct PoseFit {
  geometry::Pose X_WO;
  Eigen::Vector3d centre_W_m = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<Eigen::Vector3d>
      residual_W_m;                ///< measured less fitted, per mapped node in the measurement's order
  std::vector<std::size_t> nodes;  ///< which measured nodes those are
  double chi2 = 0.0;               ///< sum of squared residuals in units of their errors
  int degrees = 0;                 ///< 3 per node, less 6
  double probability() const { return degrees > 0 ? chi_square_tail(chi2, degrees) : 1.0; }
  double position_sigma_m() const;       ///< √ of the greatest variance of the shift along any direction
  double orientation_sigma_rad() const;  ///< √ of the greatest variance of the turn about any axis
};

/// Rotation and shift that bring points `from` nearest to points `to`, all alike in weight (Kabsch). Needs
/// three points not in line for an answer of its own.
geometry::Pose rigid_fit(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to);

/// Least squares over all mapped nodes, each weighted by its covariance (Gauss–Newton on the pose), from
/// `start`. Refuses what does not determine the pose: less than three nodes, or nodes in line. Not real-time
/// safe.
core::Expected<PoseFit> refine(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                               const geometry::Pose& start);

/// ∂(displacement of a point that moves with the part)/∂(θ, d), for a point given in W at the fitted pose.
Eigen::Matrix<double, 3, 6> displacement_jacobian(const PoseFit& fit, const Eigen::Vector3d& p_W_m);

/// How far the worst point of the part may be from where the fitted model has it: the bound that it keeps
/// with probability `confidence`, m. By random poses of the fit's covariance, the same ones at each call; on
/// the safe side of that sample.
double worst_displacement_m(const PartModel& part, const PoseFit& fit, double confidence);

/// The same for a true pose that is known: the distance of the part's point that is farthest from where the
/// model has it.
double displacement_between_m(const PartModel& part, const geometry::Pose& model_WO,
                              const geometry::Pose& true_WO);

/// Skin voxels that cover a displacement (A.5.2): its number of voxels, rounded up.
int guard_voxels(double displacement_m, double voxel_size_m);

/// A node without which the others would fit: its range is probably wrong.
struct Misfit {
  std::size_t node = 0;           ///< index into Measurement::nodes
  double off_m = 0.0;             ///< its distance from where the others' fit has it
  double along_beam_m = 0.0;      ///< of this, along the beam: too long (+) or too short (−)
  double rest_probability = 0.0;  ///< of the fit of the others
};
/// Leaves out each node in turn; those whose absence makes the rest fit, the likeliest first. Empty if none
/// does.
std::vector<Misfit> find_misfits(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                                 const PoseFit& fit, double least_probability);

}  // namespace phantom::survey
