#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "components/synthetic_viewer/render/ray_scene.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

/// Returns the shortest way from points of the tool to the surface of an object that is nearer than
/// `within_m`; nothing if none is. Allocates nothing.
std::optional<ToolGap> tool_gap(std::span<const Eigen::Vector3d> tool_m, const RayScene& objects,
                                double within_m);

/// The view *tool to object* of a contact that is wanted, which raises no alert: lateral to the way between
/// them, shown when the operator asks for it, or a gripper that may take something nears what fits between
/// its fingers. Time comes in as dt only. Not thread-safe.
class ToolApproach {
 public:
  static constexpr double kReach_m = 0.5;                    ///< farther objects are none that it nears
  static constexpr double kBegins_m = 0.10, kEnds_m = 0.15;  ///< gaps at which it comes by intent, and goes
  static constexpr double kDwell_s = 0.3;                    ///< for so long, before it comes
  /// HitView::alert of this view: no alert has this number.
  static constexpr std::uint32_t kAlert = 0xFFFFFFFF;

  /// `scale`: of the scene (scene_scale()), by which the distances above count.
  explicit ToolApproach(const ViewChoiceConfig& config, double scale = 1.0)
      : chooser_(config), scale_(scale) {}

  struct Inputs {
    std::optional<ToolGap> gap;
    bool asked = false;            ///< by the operator
    std::optional<double> open_m;  ///< width of a gripper that holds nothing; none: there is no such
    ViewNode chosen = ViewNode::kAutomatic;
  };
  /// Advances by one frame. Returns what is shown; alert 0: nothing.
  HitView step(const Inputs& in, const VisibleShare& visible, double dt_s);

 private:
  ViewChooser chooser_;
  double scale_;
  bool intended_ = false, shown_ = false;
  double near_s_ = 0.0;  // for how long it has been near
};

}  // namespace phantom::synthetic_viewer
