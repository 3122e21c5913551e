#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/robot/skin/skin.hpp"

namespace phantom::robot {

/// Sensors all over a body that an arm may carry, in the body's frame.
struct BodySkin {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<double> areas_m2;  ///< that each stands for
};

/// A body that is fixed to a link of the arm (URDF or DH), with its pose in the frame of that link.
struct CarriedBody {
  std::string link;
  geometry::Pose X_FO;
  const BodySkin* skin = nullptr;
};

/// Spreads sensors over a body as lay_out_skin() does over a link's mesh (MeshSensors): the same places,
/// pitch and areas. Errors say what is allowed: no surface, a surface too large, too many sensors. Not
/// real-time safe.
core::Expected<BodySkin> lay_out_body(const geometry::TriangleMesh& mesh_m, const SkinOptions& options);

/// Returns the skin of an arm that carries bodies: that of lay_out_skin() if each body were a mesh on its
/// link, after all other parts there; bit for bit but for Normalisation::kCount, whose weights agree to 1e-15
/// (relative). A sensor of the arm keeps its place among its link's point or cluster sensors. Errors: no such
/// link, a link that does not move, more sensors than options.max_sensors. Not real-time safe.
core::Expected<SkinLayout> skin_with_bodies(const SerialArm& arm, const SkinLayout& own,
                                            std::span<const CarriedBody> bodies, const SkinOptions& options);

}  // namespace phantom::robot
