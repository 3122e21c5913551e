#include "components/synthetic_viewer/scene/tool_approach.hpp"

#include <utility>

namespace phantom::synthetic_viewer {

std::optional<ToolGap> tool_gap(std::span<const Eigen::Vector3d> tool_m, const RayScene& objects,
                                double within_m) {
  std::optional<ToolGap> gap;
  for (const RayScene::Body& body : objects.bodies) {
    const geometry::Pose X_MW = body.X_WM.inverse();
    for (const Eigen::Vector3d& point_m : tool_m) {
      const auto nearest_m = body.mesh->closest(X_MW * point_m, within_m);
      if (!nearest_m) continue;
      const Eigen::Vector3d object_m = body.X_WM * *nearest_m;
      within_m = (object_m - point_m).norm();
      gap = ToolGap{body.name.object, point_m, object_m, within_m, body.mesh->size_m().minCoeff()};
    }
  }
  return gap;
}

HitView ToolApproach::step(const Inputs& in, const VisibleShare& visible, double dt_s) {
  const bool may_take = in.gap && in.open_m && in.gap->object_side_m <= *in.open_m;
  const bool near = may_take && in.gap->gap_m < scale_ * (intended_ ? kEnds_m : kBegins_m);
  near_s_ = near ? near_s_ + dt_s : 0.0;
  intended_ = near && (intended_ || near_s_ >= kDwell_s);
  const bool was_shown = std::exchange(shown_, in.gap && (in.asked || intended_));
  if (!shown_) return {};
  if (!was_shown) chooser_.release();
  HitView view;
  view.alert = kAlert;
  view.approach = in.gap;
  view.situation = {0.5 * (in.gap->tool_m + in.gap->object_m), in.gap->object_m - in.gap->tool_m, in.chosen};
  view.node = chooser_.step(view.situation, visible, dt_s);
  view.eye_m = chooser_.eye_m(view.situation);
  return view;
}

}  // namespace phantom::synthetic_viewer
