#include "components/synthetic_viewer/render/frame.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kSamePlace_m = 1e-5;

template <class A, class B>
bool same(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return (a - b).cwiseAbs().maxCoeff() < kSamePlace_m;
}

bool same(const Camera& a, const Camera& b) {
  return same(a.eye_m, b.eye_m) && same(a.target_m, b.target_m) && a.vertical_fov_rad == b.vertical_fov_rad &&
         same(a.up, b.up) && a.near_m == b.near_m && a.far_m == b.far_m;
}

bool same(const DrawItem& a, const DrawItem& b) {
  return a.mesh == b.mesh && a.colour == b.colour && a.opacity == b.opacity && a.own_light == b.own_light &&
         a.casts_shadow == b.casts_shadow && a.paint == b.paint && a.over_video == b.over_video &&
         same(a.W_from_mesh, b.W_from_mesh) && same(a.paint_from_mesh, b.paint_from_mesh);
}

}  // namespace

Eigen::Matrix4f matrix_of(const geometry::Pose& X_WM, const Eigen::Vector3d& scale) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.topLeftCorner<3, 3>() = (X_WM.rotation * scale.asDiagonal()).cast<float>();
  matrix.topRightCorner<3, 1>() = X_WM.translation_m.cast<float>();
  return matrix;
}

bool same_picture(const Frame& a, const Frame& b) {
  if (!same(a.camera, b.camera) || a.items.size() != b.items.size() || a.lines.size() != b.lines.size() ||
      a.paint_number != b.paint_number || a.paint_ramp != b.paint_ramp || a.line_colour != b.line_colour ||
      a.backdrop != b.backdrop || a.bold_lines != b.bold_lines || !same(a.floor_min_m, b.floor_min_m) ||
      !same(a.floor_max_m, b.floor_max_m)) {
    return false;
  }
  for (std::size_t i = 0; i < a.items.size(); ++i) {
    if (!same(a.items[i], b.items[i])) return false;
  }
  for (std::size_t i = 0; i < a.lines.size(); ++i) {
    if (!same(a.lines[i].from_m, b.lines[i].from_m) || !same(a.lines[i].to_m, b.lines[i].to_m)) return false;
  }
  return true;
}

}  // namespace phantom::synthetic_viewer
