#include "components/workspace_camera/simulated_camera.hpp"

#include "common/geometry/implicit/primitives.hpp"
#include "components/workspace_camera/depth_raster.hpp"

namespace phantom::workspace_camera {
namespace {

geometry::TriangleMesh shape_of(const Thing& thing) {
  const Eigen::Vector3d& size_m = thing.size_m;
  switch (thing.shape) {
    case Thing::Shape::kBall:
      return geometry::make_sphere(0.5 * size_m.x(), 4);
    case Thing::Shape::kCylinder:
      return geometry::make_cylinder(0.5 * size_m.x(), size_m.z());
    case Thing::Shape::kBox:
      break;
  }
  return geometry::make_box(size_m);
}

}  // namespace

SimulatedCamera::SimulatedCamera(const SimulatedOptions& options, const geometry::Pose& X_WC,
                                 const fusion::CameraScene& cell, const std::vector<Thing>& things,
                                 std::vector<DisplacedMesh> displaced)
    : options_(options),
      X_CW_(X_WC.inverse()),
      things_(things),
      displaced_(std::move(displaced)),
      depth_mm_(options.camera.pixels()) {
  for (const Thing& thing : things_) shapes_.push_back(shape_of(thing));
  cell.render(options_.camera, X_WC, cell_);
}

void SimulatedCamera::draw(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM, bool steel) {
  draw_mesh(mesh, X_CW_ * X_WM, options_.camera, corners_m_,
            [&](std::size_t pixel, double depth_m, double cosine) {
              fusion::SeenPixel& seen = seen_[pixel];
              if (depth_m < options_.camera.min_depth_m) return;
              if (seen.depth_m != 0.0F && depth_m >= static_cast<double>(seen.depth_m)) return;
              seen = {static_cast<float>(depth_m), static_cast<float>(cosine), 0.0F, steel};
            });
}

std::span<const std::uint16_t> SimulatedCamera::image(double time_s, const ArmView* arm,
                                                      const ArmPose* pose) {
  seen_ = cell_;
  for (std::size_t i = 0; i < things_.size(); ++i)
    if (things_[i].is_there(time_s))
      draw(shapes_[i], {Eigen::Matrix3d::Identity(), things_[i].middle_m(time_s)}, things_[i].steel);
  for (const DisplacedMesh& one : displaced_) {
    const Eigen::Vector3d by_m = time_s < one.from_s ? Eigen::Vector3d::Zero() : one.by_m;
    draw(one.mesh_W, {Eigen::Matrix3d::Identity(), by_m}, false);
  }
  if (arm != nullptr && pose != nullptr) {
    robot::LinkPoses X_WL;
    arm->arm().link_poses(pose->q, X_WL);
    for (const LinkPart& part : arm->parts())
      draw(part.mesh, ArmView::pose_of(part, X_WL, pose->closing), false);
  }
  fusion::measure_depth(options_.camera, seen_, options_.noise, options_.seed, frame_++, depth_mm_);
  return depth_mm_;
}

}  // namespace phantom::workspace_camera
