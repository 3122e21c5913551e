#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"
#include "common/survey/fit.hpp"
#include "common/survey/touch_surface.hpp"

namespace phantom::survey {

/// A contact that was felt: a ball (a probing tool's tip), or a point of the arm, lies on a surface.
struct Touch {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  ///< the ball's centre, or the point
  double radius_m = 0.0;                            ///< of the ball; 0: a point
  double sigma_m = 0.0005;  ///< standard deviation of the ball's distance from what it touches
  /// The direction of the force that the surface exerts: unit, away from the surface. None: not felt.
  std::optional<Eigen::Vector3d> normal_W;
};

/// A place where such a ball was and touched nothing.
struct FreePlace {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
  double sigma_m = 0.0005;
};

struct TouchOptions {
  /// What is believed of the model's pose before it is touched, one sigma: each axis of its shift, and each
  /// of its turn about the middle of the object.
  double prior_position_sigma_m = 0.010;
  double prior_orientation_sigma_rad = 0.01745;
  double normal_cone_rad = 1.0472;  ///< a felt normal departs from that of the touched face by no more
  double gate_sigmas = 5.0;  ///< a touch that lies farther off than this is explained by something else
  /// Directions are determined as long as 2.5 sigma of all of them together displace no point of the object
  /// by more than this.
  double determined_m = 0.002;
  double confidence = 0.99;  ///< of the stated displacement; and that no other pose explains the touches
  double least_fit_probability = 0.001;  ///< fits that errors alone make less likely than this are refused
};

/// A way in which the object may move, of those that the touches determine or leave open.
struct TouchDirection {
  Eigen::Matrix<double, 6, 1> motion;  ///< (θ, d) of one sigma, in rad and m, as in PoseFit
  double sigma_m = 0.0;                ///< by which that displaces the object's worst point
  std::string words;                   ///< "shift along z of W", with its sigma
};

/// What touches say about an object's pose.
struct TouchCorrection {
  geometry::Pose model_WO;  ///< before
  /// The corrected pose with its covariance, that of what the touches leave open included. Nodes and
  /// residuals of PoseFit are not used. `degrees`: touches to spare.
  PoseFit fit;
  std::vector<double> before_m, after_m;  ///< per touch: gap (+) or overlap (−) of ball and model
  std::vector<std::size_t> unexplained;   ///< touches that the corrected model does not explain
  std::vector<TouchDirection> determined, open;
  bool contradicts = false;     ///< the touches, or the places without one, contradict the model as it was
  double worst_before_m = 0.0;  ///< so far may a point of the object be from the model as it was
  double worst_after_m = 0.0;   ///< and so far from the corrected one; both with the options' confidence
  double moved_m = 0.0;         ///< greatest displacement of a point of the object by the correction
  double turned_rad = 0.0;      ///< and its turn
  std::optional<geometry::Pose> rival_WO;  ///< another pose that explains the touches as well
  std::string refusal;                     ///< why the correction must not be applied; empty: it may be
};

/// Corrects an object's pose by touches, and by places where nothing was touched: the most probable pose
/// under a normal prior about `model_WO`. The gap of each ball to the nearest surface (with a felt normal: to
/// the nearest that faces so) is normally distributed about 0; of a free place, not below 0. Each touch may
/// also be of something else, at the price of the gate. Starts from many poses of the prior, so that a touch
/// near an edge is not bound to the face that is nearest in the wrong model. Two poses that explain the
/// touches alike, but differ in what they are said to determine, are a refusal. Deterministic. Needs a touch
/// or a free place; refuses numbers that are not finite. Not real-time safe.
core::Expected<TouchCorrection> correct_by_touch(const TouchSurface& surface, const geometry::Pose& model_WO,
                                                 const std::vector<Touch>& touches,
                                                 const std::vector<FreePlace>& free,
                                                 const TouchOptions& options = {});

/// Returns the corrected pose without what the touches leave open: in those directions the object stays where
/// the model has it. `correction`: made with these options; `centre_O_m`: of the touched surface. Pure.
geometry::Pose determined_pose(const TouchCorrection& correction, const Eigen::Vector3d& centre_O_m,
                               const TouchOptions& options = {});

/// Splits a normally distributed error of a pose into ways to move that are known to `determined_m`, the best
/// known first (2.5 sigma of them together at the worst of `extremes_W_m`; by touches more than by the
/// prior), and those that are not, and puts them into words. `information`: of the touches alone, about
/// `centre_W_m`; the prior is that of the options. Either are orthogonal in units of the prior; shifts come
/// first, along the axes of W as far as possible.
void split_directions(const Eigen::Matrix<double, 6, 6>& information, const Eigen::Vector3d& centre_W_m,
                      const std::vector<Eigen::Vector3d>& extremes_W_m, const TouchOptions& options,
                      std::vector<TouchDirection>& determined, std::vector<TouchDirection>& open);

/// Returns by how much a small motion (θ, d) about `centre_W_m` displaces the worst of `extremes_W_m`, as far
/// as it lies in these directions.
double displacement_in_m(const std::vector<TouchDirection>& directions,
                         const Eigen::Matrix<double, 6, 1>& motion, const Eigen::Vector3d& centre_W_m,
                         const std::vector<Eigen::Vector3d>& extremes_W_m, const TouchOptions& options);

}  // namespace phantom::survey
