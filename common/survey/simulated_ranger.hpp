#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <random>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/survey/range_head.hpp"

namespace phantom::survey {

/// The surfaces that a ranger sees. Frame W. Immutable; queries are thread-safe. Not real-time safe.
class RangerScene {
 public:
  /// The nearest surface along a ray.
  struct Hit {
    double range_m = 0.0;
    double cosine = 0.0;  ///< of the incidence, 0…1
  };

  explicit RangerScene(const geometry::TriangleMesh& mesh_W);

  /// Returns the nearest surface on either side of a triangle along a ray with unit direction, up to
  /// `max_range_m`; none if there is none.
  std::optional<Hit> nearest(const Eigen::Vector3d& from_W_m, const Eigen::Vector3d& direction_W,
                             double max_range_m) const;

 private:
  geometry::BoxTree tree_;
  std::vector<std::array<Eigen::Vector3d, 3>> triangles_m_;  // in the tree's order
};

/// How a simulated ranger measures, beside the errors of its data sheet.
struct RangerOptions {
  int rays = 61;                 ///< over the spot
  double range_step_m = 0.0001;  ///< resolution of ranges
  double angle_step_rad = 1e-5;  ///< resolution of the encoders of pan and tilt
  double least_echo = 0.02;      ///< of the light that a perpendicular face returns: less is no echo
  double jitter = 0.1;           ///< share of the bounds of pan and tilt that changes from reading to reading
};

/// A pan–tilt head with a ranger that measures by its whole spot: rays over the footprint, weighted by the
/// light that each returns (the cosine of its incidence), are averaged. Over an edge, the background is mixed
/// in. The ranger's errors and those of aiming the head are drawn by the law: pan and tilt at each turn, with
/// a small jitter at each reading; the range at each reading. Deterministic for a seed. One thread.
class SimulatedRanger {
 public:
  /// `head`: as it is really mounted. `errors`: targeting is a person's, and not simulated.
  SimulatedRanger(const RangeHead& head, const HeadErrors& errors, RangerScene scene, std::uint64_t seed,
                  const RangerOptions& options = {});

  const RangeHead& head() const { return head_; }
  /// Turns the head. The range of the result is 0. The angles are those that the encoders report.
  Reading aim(double pan_rad, double tilt_rad);
  /// Takes a reading where the head points. Refuses: no echo; nearer or farther than the ranger measures.
  core::Expected<Reading> measure();

 private:
  std::optional<double> footprint_range_m(const Reading& axis) const;

  RangeHead head_;
  HeadErrors errors_;
  RangerScene scene_;
  RangerOptions options_;
  std::mt19937_64 random_;
  Reading reported_;                               // where the encoders say that it points
  double pan_off_rad_ = 0.0, tilt_off_rad_ = 0.0;  // the true direction less the reported one
};

}  // namespace phantom::survey
