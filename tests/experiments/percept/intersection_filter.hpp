#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::experiments {

/// How the filters decide (thesis table 3.2). Both let the same triangles through.
enum class FilterForm {
  kUnoptimised,  ///< distances with their square roots, angles by arc cosine
  kOptimised     ///< squares of distances, the sign of a dot product
};

/// How many objects or triangles each filter of the chain was asked about.
struct FilterQueries {
  std::uint64_t seso = 0;  ///< smallest encapsulating sphere of an object
  std::uint64_t sess = 0;  ///< smallest encapsulating sphere of a triangle
  std::uint64_t sdt = 0;   ///< surface direction test: does the triangle face the probe?
  std::uint64_t idp = 0;   ///< intersection of the probe's line with the triangle's plane
  std::uint64_t rt = 0;    ///< range test of that point
  std::uint64_t vit = 0;   ///< is that point within the triangle?

  FilterQueries& operator+=(const FilterQueries& other) noexcept;
};

/// Floating point cost of one query of each filter (thesis table 3.2: addition, subtraction, comparison,
/// trigonometric function from a table 1; multiplication 2; division, square root 23), in the units with
/// which the sums of tables 3.3 and 3.4 add up.
struct FilterUnits {
  std::uint64_t seso, sess, sdt, idp, rt, vit;
};
constexpr FilterUnits filter_units(FilterForm form) noexcept {
  return form == FilterForm::kOptimised ? FilterUnits{12, 12, 12, 57, 14, 82}
                                        : FilterUnits{35, 35, 82, 57, 14, 82};
}
/// Σ Load of tables 3.3 and 3.4.
std::uint64_t filter_load(const FilterQueries& queries, FilterForm form) noexcept;

/// What the chain consists of. The defaults are the thesis's.
struct FilterChain {
  bool tests_facing =
      true;  ///< else the surface direction test lets all triangles pass but those along the probe
  bool bounds_by_box = false;   ///< smallest box along the axes, SEBO, in place of the sphere SESO
  bool triangle_first = false;  ///< VIT before RT
};

/// Where a probe meets a surface.
struct ProbeHit {
  double distance_m = 0.0;
  std::size_t object = 0, triangle = 0;  ///< indices into the scene
};

/// The search-based way of finding what is near (thesis 3.2, kept as the baseline of the voxel method): a
/// probe vector p→q is intersected with the triangles of all objects, through a chain of filters that end the
/// work on an object or a triangle early. What a filter needs is computed once, for the objects where they
/// stand. Constant after construction.
class IntersectionScene {
 public:
  /// Closed meshes whose triangles face outwards. Frame: W. Degenerate triangles are never hit.
  explicit IntersectionScene(const std::vector<geometry::TriangleMesh>& objects_W,
                             const FilterChain& chain = {});

  /// The nearest triangle on the probe from `p_W_m` along `direction` (unit vector) within `length_m` that
  /// faces the probe; a point outside all objects can meet no other first. Adds to `queries`. Cost: linear in
  /// the triangles of the objects whose sphere the probe may reach, so it depends on the place. Real-time
  /// safe: yes, without a bound of its own.
  std::optional<ProbeHit> probe(const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& direction,
                                double length_m, FilterForm form, FilterQueries& queries) const noexcept;

  std::size_t object_count() const noexcept { return objects_.size(); }

 private:
  struct Sphere {
    Eigen::Vector3d centre_m;
    double radius_m;
  };
  struct Triangle {
    Sphere sphere;                    // SESS
    Eigen::Vector3d a_m, ab_m, ac_m;  // a corner and the edges from it
    Eigen::Vector3d normal;           // ab × ac, not normalised
    std::size_t index;                // in its mesh
  };
  struct Object {
    Sphere sphere;              // SESO
    geometry::BoundingBox box;  // SEBO
    std::vector<Triangle> triangles;
  };
  static Sphere sphere_around(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
  static bool in_reach(const Sphere& sphere, const Eigen::Vector3d& p, double length_m,
                       FilterForm form) noexcept;
  bool in_scope(const Object& object, const Eigen::Vector3d& p, double length_m,
                FilterForm form) const noexcept;
  bool faces(const Triangle& triangle, const Eigen::Vector3d& direction, FilterForm form) const noexcept;
  /// Whether a point of the triangle's plane lies within it.
  static bool holds(const Triangle& triangle, const Eigen::Vector3d& p) noexcept;

  FilterChain chain_;
  std::vector<Object> objects_;
};

/// `count` ≥ 1 unit vectors spread evenly over the half of the sphere around `axis` (unit vector), the rim
/// included as far as their number allows: grazing motion is sensed by probes across it, the thesis says more
/// than 32 (3.2.6). Spherical Fibonacci points. Allocates.
std::vector<Eigen::Vector3d> front_hemisphere(const Eigen::Vector3d& axis, int count);

}  // namespace phantom::experiments
