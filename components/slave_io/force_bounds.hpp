#pragma once

#include <Eigen/Geometry>
#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::slave_io {

/// Boxes around the skin of each link, in its frame, by link; empty ones where there is no skin.
using LinkBoxes = std::array<Eigen::AlignedBox3d, core::kMaxJoints + 1>;

/// How hard the arm may press on an object, by the cell file.
struct ObjectForceBound {
  std::uint16_t object = 0;
  std::string name;
  double force_N = 0.0;
  double pose_error_m = 0.0;      ///< no point of it is farther from where the model has it
  Eigen::AlignedBox3d box_O_m{};  ///< around it, in its frame; empty: not known
  /// In W, by the cell file; none: something moves it, so it may be anywhere.
  std::optional<geometry::Pose> X_WO{};
};

/// Greatest number of objects of a cell that may state what force they bear.
inline constexpr std::size_t kMaxBoundedObjects = 32;

/// Where the objects with a bound are now, in the order of Config::object_bounds. Plain data, for a
/// core::Snapshot.
struct BoundedPlaces {
  enum class Place : std::uint8_t { kAsConfigured, kAnywhere, kGone, kAtPose };
  struct Object {
    Place place = Place::kAsConfigured;
    std::array<double, 9> rotation_rows{};  ///< of X_WO, at kAtPose
    std::array<double, 3> translation_m{};
  };
  std::array<Object, kMaxBoundedObjects> objects{};
  bool carries = false;  ///< the arm carries something, which may touch what the arm itself does not reach

  void stand_at(std::size_t index, const geometry::Pose& X_WO) noexcept;
};

/// Returns the bounds of a cell's objects (max_contact_force_N). Throws ConfigError for more than
/// kMaxBoundedObjects.
std::vector<ObjectForceBound> object_bounds(const runtime::CellConfig& cell);
/// Likewise with the boxes of their surfaces, which it loads. Throws ConfigError. Not real-time safe.
std::vector<ObjectForceBound> object_bounds_with_boxes(const runtime::CellConfig& cell);
/// Returns the boxes of an arm's skin, with the gripper open and closed. Sensors on a link's axis count with
/// the link's radius; `voxel_m`: of the cell, for those without. Throws ConfigError. Not real-time safe.
LinkBoxes link_boxes(const robot::SerialArm& arm, const std::vector<robot::LinkSkin>& skin, double voxel_m);

/// Which object's bound holds when the arm touches something.
///
/// Where it is known what is touched, that object's. Else the least one of those that the arm may be
/// touching: whose box is no farther from a link's box than kReach_m and the error of the object's pose. An
/// arm without boxes reaches everything, as does one that carries something; an object without a box, or of
/// which nobody knows where it is, is within reach.
/// Boxes are compared by separating axes (S. Gottschalk, M. C. Lin, D. Manocha, OBBTree, SIGGRAPH 1996).
/// Real-time safe: yes, but for the constructor.
class ForceBounds {
 public:
  struct Bound {
    double force_N = 0.0;      ///< 0: as hard as the arm can
    std::uint16_t object = 0;  ///< whose bound it is; 0: nobody's
  };
  /// How far a body may be from its model, beside the stated error of its pose: of arm and object together.
  static constexpr double kReach_m = 0.05;

  ForceBounds(std::vector<ObjectForceBound> objects, const LinkBoxes& links);

  /// Takes where the objects are now.
  void place(const BoundedPlaces& places) noexcept;
  /// Returns the bound of a contact with `object`, or with what the arm may touch at these poses (0).
  Bound of(std::uint16_t object, const robot::LinkPoses& X_WL) const noexcept;
  bool empty() const noexcept { return objects_.empty(); }

 private:
  struct Standing {
    BoundedPlaces::Place place = BoundedPlaces::Place::kAnywhere;
    geometry::Pose X_WO;
  };
  bool may_touch(std::size_t index, const robot::LinkPoses& X_WL) const noexcept;

  std::vector<ObjectForceBound> objects_;
  std::vector<Standing> standing_;  // of each object
  std::vector<std::size_t> links_;  // that have a box
  LinkBoxes boxes_;
  bool carries_ = false;
};

}  // namespace phantom::slave_io
