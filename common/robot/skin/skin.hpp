#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/joints.hpp"
#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::robot {

/// Which voxels of a cluster sensor's zone count, and how much (the thesis's shaping arrays, 6.2.2).
enum class ClusterShape {
  kCube,             ///< binary, all of the (2m+1)³ voxels
  kSphere,           ///< binary, type 1: voxels whose centres are within m voxels of the zone's centre
  kSphereContained,  ///< likewise within m + ½: the sphere that the cube contains, 48 % fewer voxels at m = 3
  kFraction          ///< type 2: each voxel by the fraction of it inside the sphere of radius m + ½ voxels
};

/// A cluster sensor (the thesis's enhanced sensor, 6.2–6.4): reads a zone of voxels instead of a single one.
/// Where voxels are no cubes, m counts in their shortest side along every axis.
struct ClusterSpec {
  static constexpr int kMaxReach_vox = 15;
  int reach_vox = 3;  ///< m, 1…15
  ClusterShape shape = ClusterShape::kSphere;
  friend bool operator==(const ClusterSpec&, const ClusterSpec&) = default;
};

/// A corner of a section's polygon (thesis 5.7.2): distance from the axis, and angle around it.
struct PolygonPoint {
  double r_m = 0.0, psi_rad = 0.0;
};

/// A structured patch of skin (thesis 5.7), in the frame of a URDF or DH link. It has a polygon around each
/// end of an axis, and sensors on the straight lines between their corners. The polygons are regular with the
/// given circumradii, or arbitrary: `from_polygon` (PTP) and `to_polygon` (PBP). An empty `to_polygon`
/// repeats `from_polygon` (a segment of type a). Angles count from the one of x, y and z that is most nearly
/// perpendicular to the segment's axis (the first, if several are), projected onto the plane across the axis.
/// They are positive towards axis × that direction.
struct SkinSegment {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double from_radius_m = 0.0;  ///< circumradius of a regular polygon at `from_m`
  double to_radius_m = 0.0;    ///< and at `to_m`
  /// Sensors around a ring, ≥ 3. Absent: as few as the pitch allows; on given polygons, points are added to
  /// the edges until the pitch is kept. With given polygons it must equal their number of corners.
  std::optional<int> sides;
  /// Rings along the axis, both ends included (K + 1), ≥ 2. Absent: as few as the pitch allows.
  std::optional<int> rings;
  double spin_rad = 0.0;  ///< ω, rotation of the first corner about the axis
  double gain = 1.0;      ///< SG, ≥ 0
  std::vector<PolygonPoint> from_polygon, to_polygon;
  /// Makes every sensor a netting sensor (thesis 6.4.1). The pitch then only has to be below m voxels.
  std::optional<ClusterSpec> cluster;
};

/// Sensors on a straight line, k = 1…K at from + (k/K)·(to − from). They cover the thesis's simple axis
/// sensors (eqs. 5.2–5.4), slender link sensors (6.4.2) and, with m falling towards the tip, finger sensors
/// (6.4.3). Cluster sensors are spheres, so only their centres move with the link.
struct AxisSensors {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  std::optional<int> count;  ///< K, ≥ 1; absent: the fewest whose pitch is below one voxel, or below m voxels
  std::optional<ClusterSpec> cluster;  ///< absent: point sensors
  std::optional<int> tip_reach_vox;    ///< m at `to_m`, 1…m; m falls linearly to it along the line
  /// Radius of the link. A sensor's area is that of the cylinder of this radius around its share of the line.
  /// Absent: (m + ½) voxels. Point sensors need it when sensors are weighted by area, since a point has no
  /// area.
  std::optional<double> radius_m;
  double gain = 1.0;  ///< ≥ 0
};

/// Sensors all over a mesh, in the frame of a link. Each represents the part of the surface that is nearest
/// to it, so the areas add up to the mesh's area. No two sensors are closer than 0.7 of the pitch, and no
/// point of the surface is farther than that from a sensor (a Poisson-disk set, the same for the same mesh).
struct MeshSensors {
  geometry::TriangleMesh mesh_m;
  double gain = 1.0;                   ///< ≥ 0
  std::optional<ClusterSpec> cluster;  ///< as for SkinSegment
  Eigen::Vector3d closing_m =
      Eigen::Vector3d::Zero();  ///< its way as the gripper closes, in the frame of `link`
};

struct LinkSkin {
  std::string link;  ///< URDF or DH link
  std::vector<SkinSegment> segments;
  std::vector<AxisSensors> axes;
  std::vector<MeshSensors> meshes;
  Eigen::Vector3d closing_m =
      Eigen::Vector3d::Zero();  ///< of segments and axes: as MeshSensors has it of a mesh
};

/// Sets a segment's ends from the thesis's figures. `offset_m` (SOJ) and `length_m` (SL) lie along the axis
/// of the moving link that holds `link` (LASP to LAEP, or the link's z axis if they coincide). The ends are
/// given in the frame of `link`; the rest of the segment stays as it is. Returns false if the arm has no such
/// link.
bool place_along_link_axis(const SerialArm& arm, const std::string& link, double offset_m, double length_m,
                           SkinSegment& segment);

/// How sensors are weighted relative to each other (spec 2.4).
enum class Normalisation {
  kArea,    ///< by each sensor's area (eq. 4.4): the drag converges as the skin is refined
  kCount,   ///< one each, divided by the number of sensors on the link (eqs. 5.8, 5.9)
  kActive,  ///< one each, divided by the number of sensors on the link that meet fluid (eq. 5.10)
  kNone     ///< one each
};

/// All sensors of an arm, link by link, as a structure of arrays in the coordinates of the link that carries
/// them (SerialArm::links). Constant after loading.
struct SkinLayout {
  Normalisation normalisation = Normalisation::kArea;
  std::array<std::size_t, core::kMaxJoints + 2> first{};  ///< sensors of link l are first[l] … first[l+1] − 1
  /// Index of each link's first cluster sensor; its point sensors come before.
  std::array<std::size_t, core::kMaxJoints + 1> first_cluster{};
  std::vector<double> x_m, y_m, z_m;  ///< in the link's frame, of a gripper's fingers at their widest
  /// Way of each sensor in the link's frame as the gripper closes; empty: none moves.
  std::vector<Eigen::Vector3d> closing_m;
  /// Gain × area in m² (kArea), gain ÷ sensors of the link (kCount), gain (the others).
  std::vector<double> weight;
  std::vector<double> area_m2;        ///< area that the sensor represents, without gain
  std::vector<ClusterSpec> clusters;  ///< kinds of cluster sensors
  /// VoxelSize::stretch() of the voxels that cluster sensors read.
  Eigen::Vector3d voxel_stretch = Eigen::Vector3d::Ones();
  std::vector<std::uint8_t> cluster_kind;  ///< for each sensor: 0 for a point, else 1 + index in `clusters`
  std::size_t left_out = 0;  ///< parts left out because they are on the base, which does not move
  std::size_t size() const noexcept { return x_m.size(); }
  Eigen::Vector3d position(std::size_t sensor) const { return {x_m[sensor], y_m[sensor], z_m[sensor]}; }
  /// Returns where a sensor is with the gripper closed by `share`, 0…1. Real-time safe: yes.
  Eigen::Vector3d position(std::size_t sensor, double share) const {
    if (closing_m.empty()) return position(sensor);
    return position(sensor) + share * closing_m[sensor];
  }
  /// Returns the link that carries a sensor. Real-time safe: yes.
  std::size_t link_of(std::size_t sensor) const noexcept;
  /// Returns the least and the greatest corner of the box around a link's sensors in its frame, with the
  /// gripper open and closed; none without sensors.
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> box_of(std::size_t link) const;
};

struct SkinOptions {
  /// Pitch and areas count in the shortest side; cluster sensors read zones as wide in metres along each
  /// axis.
  workspace::VoxelSize voxel_size_m = 0.005;
  /// Greatest distance between neighbouring sensors, as a share of the voxel size. The thesis allows up to 1
  /// (eqs. 5.22, 5.23). Above 1 the skin is coarser than the voxels: fewer sensors, but steps in the drag.
  double pitch_vox = 0.99;
  Normalisation normalisation = Normalisation::kArea;
  std::size_t max_sensors = 1'000'000;
};

/// Lays out the sensors. Segments are interpolated linearly between the polygons' corners (eqs. 5.24, 5.25).
/// The thesis's rule on pitch (5.22, 5.23) checks given counts, and chooses the counts that are not given. A
/// sensor's area is its share of the lateral surface, bounded half-way to its neighbours; where the polygon
/// is regular, the round surface is used. So the areas of a segment add up to that surface. Errors name the
/// link, the part and what is allowed: unknown link, a pitch too wide, degenerate shapes, too many sensors,
/// no sensor at all. Not real-time safe.
core::Expected<SkinLayout> lay_out_skin(const SerialArm& arm, const std::vector<LinkSkin>& skin,
                                        const SkinOptions& options);

}  // namespace phantom::robot
