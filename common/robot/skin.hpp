#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"
#include "common/robot/serial_arm.hpp"

namespace phantom::robot {

/// A structured patch of skin (thesis 5.7): regular polygons around both ends of an axis, in the frame of a
/// URDF link, with sensors on the straight lines between their corners.
struct SkinSegment {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double from_radius_m = 0.0;  ///< circumradius of the polygon at `from_m` (PTP)
  double to_radius_m = 0.0;    ///< and at `to_m` (PBP)
  std::optional<int> sides;    ///< sensors around a ring, ≥ 3; absent: as few as the pitch allows
  std::optional<int> rings;    ///< rings along the axis, both ends included, ≥ 2; absent: likewise
  double spin_rad = 0.0;       ///< rotation of the first corner about the axis
  double gain = 1.0;           ///< SG, ≥ 0
};

struct LinkSkin {
  std::string link;  ///< URDF link
  std::vector<SkinSegment> segments;
};

/// How sensors are weighted against each other (spec 2.4).
enum class Normalisation {
  kArea,    ///< by the area that each stands for (eq. 4.4): the drag converges as the skin is refined
  kCount,   ///< one each, divided by the number of sensors on the link (eqs. 5.8, 5.9)
  kActive,  ///< one each, divided by the number of sensors on the link that meet fluid (eq. 5.10)
  kNone     ///< one each
};

/// All point sensors of an arm, link by link, as structure of arrays in the coordinates of the link that
/// carries them (SerialArm::links). Constant after loading.
struct SkinLayout {
  Normalisation normalisation = Normalisation::kArea;
  std::array<std::size_t, core::kMaxJoints + 2> first{};  ///< sensors of link l are first[l] … first[l+1] − 1
  std::vector<double> x_m, y_m, z_m;                      ///< in the link's frame
  std::vector<double>
      weight;  ///< gain × area in m² (kArea), gain ÷ sensors of the link (kCount), gain (the others)
  std::vector<double> area_m2;  ///< area that the sensor stands for, without gain
  std::size_t left_out = 0;     ///< segments on the base, which does not move
  std::size_t size() const noexcept { return x_m.size(); }
  Eigen::Vector3d position(std::size_t sensor) const { return {x_m[sensor], y_m[sensor], z_m[sensor]}; }
  /// The link that carries a sensor. Real-time safe: yes.
  std::size_t link_of(std::size_t sensor) const noexcept;
};

struct SkinOptions {
  double voxel_size_m = 0.005;
  /// Greatest distance between neighbouring sensors as a share of the voxel size. Up to 1 as in the thesis
  /// (eqs. 5.22, 5.23); above 1 the skin is coarser than the voxels: fewer sensors, at the price of steps in
  /// the drag.
  double pitch_vox = 0.99;
  Normalisation normalisation = Normalisation::kArea;
  std::size_t max_sensors = 1'000'000;
};

/// Lays out the sensors. Positions: linear interpolation between the polygons' corners (eqs. 5.24, 5.25). A
/// sensor's area is its share of the lateral surface of the round segment between the half-way planes to its
/// neighbour rings, so the areas of a segment sum up to that surface. Errors name link, segment and what is
/// allowed: unknown link, given sides or rings whose pitch is too wide, degenerate segments, too many
/// sensors, no sensor at all. Not real-time safe.
core::Expected<SkinLayout> lay_out_skin(const SerialArm& arm, const std::vector<LinkSkin>& skin,
                                        const SkinOptions& options);

}  // namespace phantom::robot
