#include "common/robot/sensing/soft_sensing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::robot {
namespace {

using workspace::Index3;

constexpr std::size_t byte_of(std::int8_t order) noexcept { return static_cast<std::uint8_t>(order); }

bool is_solid(std::int8_t order) noexcept {
  return order < workspace::kOrderFree || order >= workspace::kOrderBoundary;
}

/// The pressure in a soft body around one of its voxels.
class Surroundings {
 public:
  Surroundings(const SoftBody& body, const workspace::Workspace& workspace, Index3 at) noexcept
      : body_(body),
        workspace_(workspace),
        at_(at),
        here_Pa_(body.pressure_Pa[byte_of(workspace.order(at))]) {}

  /// Linear between the centres of the eight voxels around a point, given in voxels from the grid's corner.
  double between_Pa(const Eigen::Vector3d& p_vox) const noexcept {
    const Eigen::Array3d from_centre = p_vox.array() - 0.5;
    const Eigen::Array3i least = from_centre.floor().cast<int>();
    const Eigen::Array3d share = from_centre - least.cast<double>();
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
      const double weight = (x == 1 ? share.x() : 1.0 - share.x()) * (y == 1 ? share.y() : 1.0 - share.y()) *
                            (z == 1 ? share.z() : 1.0 - share.z());
      sum += weight * pressure_Pa({least.x() + x, least.y() + y, least.z() + z});
    }
    return sum;
  }
  /// Returns the unit vector in which the pressure falls, of true lengths; 0 where it falls in none.
  Eigen::Vector3d way_out() const noexcept {
    constexpr int kReach = SoftSensing::kReach_vox;
    constexpr double kCubes = kReach * (kReach + 1) / 2;  // length of all steps, in voxels
    const Eigen::Vector3d stretch = workspace_.grid().voxel_size_m.stretch();
    Eigen::Vector3d fall = Eigen::Vector3d::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Index3 step{};
      step[static_cast<std::size_t>(axis)] = 1;
      // As far along each axis, so that whoever is deep is not pushed along longer sides alone.
      const int steps = std::max(1, static_cast<int>(kReach / stretch[axis] + 1e-9));
      for (int k = 1; k <= steps; ++k)
        fall[axis] += pressure_Pa(at_ - k * step) - pressure_Pa(at_ + k * step);
      fall[axis] *= kCubes / (steps * (steps + 1) / 2 * stretch[axis]);
    }
    const double length = fall.norm();
    return length > 0.0 ? Eigen::Vector3d(fall / length) : fall;
  }

 private:
  // A body that the workspace's border cuts goes on beyond it. Into another solid there is no way out: it has
  // the pressure of here.
  double pressure_Pa(Index3 voxel) const noexcept {
    const auto& size = workspace_.grid().size_vox;
    const Index3 inside =
        workspace::max({0, 0, 0}, workspace::min(voxel, {size[0] - 1, size[1] - 1, size[2] - 1}));
    const std::int8_t order = workspace_.order(inside);
    if (!is_solid(order)) return 0.0;
    return workspace_.object(inside) == body_.object ? body_.pressure_Pa[byte_of(order)] : here_Pa_;
  }

  const SoftBody& body_;
  const workspace::Workspace& workspace_;
  Index3 at_;
  double here_Pa_;
};

}  // namespace

SoftBody soft_body(std::uint16_t object, const workspace::LayerProfile& profile, double reference_m) {
  SoftBody body;
  body.object = object;
  const auto& stiffness = profile.stiffness_inside_Pa_per_m;
  body.stiffness_Pa_per_m[byte_of(workspace::kOrderBoundary)] = stiffness.empty() ? 0.0 : stiffness.front();
  double above_Pa = 0.0;
  for (std::size_t i = 0; i < stiffness.size(); ++i) {
    const std::size_t order = 256 - (i + 1);  // the byte of −(i + 1)
    const double per_vox_Pa = stiffness[i] * reference_m, thickness_vox = profile.inside_thickness_vox[i];
    body.stiffness_Pa_per_m[order] = stiffness[i];
    body.pressure_Pa[order] = above_Pa + 0.5 * (thickness_vox + 1.0) * per_vox_Pa;
    above_Pa += thickness_vox * per_vox_Pa;
  }
  body.pressure_Pa[byte_of(workspace::kOrderInterior)] = above_Pa;
  return body;
}

SoftSensing::SoftSensing(std::vector<SoftBody> bodies) : bodies_(std::move(bodies)) {}

void SoftSensing::sense(const SkinSensing& sensed, const LinkPoses& X_WL,
                        const workspace::Workspace& workspace, const LinkSet& links) noexcept {
  if (bodies_.empty()) return;
  links_ = {};
  const SkinLayout& skin = sensed.layout();
  const workspace::GridSpec& grid = workspace.grid();
  sensed.for_each_in(1, [&](std::size_t link, std::size_t sensor) {
    if (!links[link]) return;
    const Eigen::Vector3d p_W_m = X_WL[link] * skin.position(sensor);
    const Index3 voxel = grid.index_of(p_W_m);
    const std::int8_t order = workspace.order(voxel);
    if (!is_solid(order)) return;
    const std::uint16_t object = workspace.object(voxel);
    const auto body = std::find_if(bodies_.begin(), bodies_.end(),
                                   [object](const SoftBody& soft) { return soft.object == object; });
    if (body == bodies_.end()) return;
    const double area_m2 = skin.area_m2[sensor];
    const Surroundings around(*body, workspace, voxel);
    const double pressure = around.between_Pa(grid.to_voxels(p_W_m));
    const Eigen::Vector3d out = around.way_out();
    if (!(pressure > 0.0) || out.isZero(0.0)) return;
    const Eigen::Vector3d d_m = p_W_m - X_WL[link].translation_m;
    Spatial along;
    along << out, d_m.cross(out);
    LinkReaction& reaction = links_[link];
    reaction.force_N += area_m2 * pressure * out;
    reaction.moment_Nm += area_m2 * pressure * along.tail<3>();
    reaction.stiffness += area_m2 * body->stiffness_Pa_per_m[byte_of(order)] * along * along.transpose();
    reaction.some = true;
  });
}

void joint_reaction(const SerialArm& arm, const LinkPoses& X_WL, const LinkReactions& links,
                    const core::JointArray& position, JointReaction& result) noexcept {
  result = {.position = position};
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    const LinkReaction& reaction = links[link];
    if (!reaction.some) continue;
    for (std::size_t j = 0; j < link; ++j) {
      const Eigen::Vector3d axis = arm.axis_W(j, X_WL);
      Spatial twist = Spatial::Zero();  // of the link about its origin, per unit of the joint's velocity
      if (arm.joints()[j].type == JointType::kPrismatic) {
        twist.head<3>() = axis;
      } else {
        twist << axis.cross(X_WL[link].translation_m - X_WL[j + 1].translation_m), axis;
      }
      result.torque[j] += twist.head<3>().dot(reaction.force_N) + twist.tail<3>().dot(reaction.moment_Nm);
      result.stiffness[j] += twist.dot(reaction.stiffness * twist);
    }
  }
}

}  // namespace phantom::robot
