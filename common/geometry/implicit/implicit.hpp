#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "common/geometry/implicit/formula.hpp"
#include "common/geometry/implicit/interval.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::geometry {

/// A region over which a formula is bounded: the intersection of an axis-aligned box and a ball with the same
/// centre. The ball does not grow when the region is rotated into another frame; the box is exact where the
/// axes agree.
struct Region {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();  ///< half the box's edges
  double radius_m = 0.0;  ///< radius of the ball; initially half the box's diagonal

  static Region box(const Eigen::Vector3d& centre_m, const Eigen::Vector3d& half_m) {
    return {centre_m, half_m, half_m.norm()};
  }
  Interval axis(int i) const { return {centre_m[i] - half_m[i], centre_m[i] + half_m[i]}; }
};

/// A box in double precision, for solids that know their bounds exactly.
struct Box {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();

  Eigen::Vector3d centre_m() const { return 0.5 * (min_m + max_m); }
  Eigen::Vector3d size_m() const { return max_m - min_m; }
  bool empty() const { return (min_m.array() > max_m.array()).any(); }
};

/// A solid given by a function of space that is below 0 inside and at or above 0 outside. The solid lies
/// within its bounding box and is closed there. Immutable, thread-safe; value() and bounds() are real-time
/// safe.
class ImplicitSolid {
 public:
  static constexpr std::size_t kShapeSteps = 8;

  virtual ~ImplicitSolid() = default;
  /// Returns f(p), which is never NaN; where a formula is undefined, the point is outside (+∞).
  virtual double value(const Eigen::Vector3d& p_m) const = 0;
  /// Returns an interval that holds value() at every point of the region.
  virtual Interval bounds(const Region& region) const = 0;
  /// Returns what one evaluation costs, in steps of a formula; a plain shape costs kShapeSteps. Real-time
  /// safe.
  virtual std::size_t steps() const { return kShapeSteps; }
  /// Returns a box that holds the whole solid; empty if the solid is certainly empty.
  virtual Box bounding_box() const = 0;
  /// Returns a simpler solid with the same values within the region, made of fewer parts; null if there is
  /// none. Allocates.
  virtual std::shared_ptr<const ImplicitSolid> within(const Region& /*region*/) const { return nullptr; }
  /// Returns the surface as a mesh if the solid is a plain shape; polygonise() meshes all others.
  virtual std::optional<TriangleMesh> tessellation() const { return std::nullopt; }
};

using ImplicitPtr = std::shared_ptr<const ImplicitSolid>;

// Plain shapes around the origin; all lengths > 0. The values of sphere, cylinder, box and torus are the
// exact signed distance in metres. Those of cone and prism are exact inside, and at most the distance
// outside.

ImplicitPtr implicit_sphere(double radius_m);
/// Cylinder along z with flat ends at ±height/2.
ImplicitPtr implicit_cylinder(double radius_m, double height_m);
/// Cone along z with its base (radius_m) at −height/2 and its top (top_radius_m, 0 for a point) at +height/2.
ImplicitPtr implicit_cone(double radius_m, double top_radius_m, double height_m);
ImplicitPtr implicit_box(const Eigen::Vector3d& size_m);
/// Prism from a triangle in the plane z = 0, in either orientation but not degenerate, extruded along z to
/// ±height/2.
ImplicitPtr implicit_prism(const std::array<Eigen::Vector2d, 3>& corners_m, double height_m);
/// Torus around z: ring radius from the axis to the tube's centre, tube radius.
ImplicitPtr implicit_torus(double ring_radius_m, double tube_radius_m);
/// The part of a box in which `f` (of x, y, z in metres) is below 0.
ImplicitPtr implicit_formula(Formula f, const Box& within);

// Combinations (constructive solid geometry). At least one part each; of one part, it is that part.

ImplicitPtr implicit_union(std::vector<ImplicitPtr> parts);
ImplicitPtr implicit_intersection(std::vector<ImplicitPtr> parts);
/// The first part minus all others.
ImplicitPtr implicit_difference(std::vector<ImplicitPtr> parts);

/// Returns the solid scaled by `scale` (> 0) about its origin and then moved by X_AB from its frame B to
/// frame A.
ImplicitPtr implicit_placed(ImplicitPtr solid, const Pose& X_AB, double scale = 1.0);

}  // namespace phantom::geometry
