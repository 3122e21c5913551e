#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "common/percept/view_node.hpp"
#include "components/synthetic_viewer/state/tool_gap.hpp"

namespace phantom::synthetic_viewer {

using percept::ViewNode;

struct ViewChoiceConfig {
  double distance_m = 0.6;    ///< distance from the look-at point to the camera
  double margin = 0.12;       ///< by how much another node's score must be better (scores are about 0 to 1)
  double dwell_s = 0.6;       ///< for how long it must be better
  double least_stay_s = 1.5;  ///< a node is kept at least this long, whatever happens
};

/// What the view must show.
struct ViewSituation {
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();  ///< point O, in W
  Eigen::Vector3d pgv = Eigen::Vector3d::Zero();        ///< towards the object, in W; 0: no direction
  ViewNode chosen = ViewNode::kAutomatic;               ///< the operator's choice
};

/// Returns the share 0…1 of a situation's hit zone that is visible from a point in W.
using VisibleShare = std::function<double(const ViewSituation&, const Eigen::Vector3d& eye_m)>;

/// Chooses the look-from node: lateral (close to the plane through the contact normal to the PGV, 6.7.1), not
/// occluded, and steady. Time comes in as dt only. Not thread-safe; step() allocates nothing.
class ViewChooser {
 public:
  explicit ViewChooser(const ViewChoiceConfig& config) : config_(config) {}

  /// Advances by one frame. Returns the node to look from now.
  ViewNode step(const ViewSituation& situation, const VisibleShare& visible, double dt_s);
  /// Lets the next step() choose freely, because the view was off. Among equal nodes the present one is
  /// preferred.
  void release() noexcept { free_ = true; }

  Eigen::Vector3d eye_m(const ViewSituation& situation) const {
    return situation.look_at_m + config_.distance_m * percept::node_direction(node_);
  }

 private:
  using Scores = std::array<double, percept::kNodeCount + 1>;  // by node number
  Scores scores(const ViewSituation& situation, const VisibleShare& visible) const;
  void change_to(ViewNode node) noexcept;

  ViewChoiceConfig config_;
  ViewNode node_ = ViewNode::kAutomatic;
  bool free_ = true;
  double stayed_s_ = 0.0;
  double better_s_ = 0.0;  // for how long some other node has been better
};

struct HitViewConfig {
  ViewChoiceConfig choice;
  /// An alert's view is shown at least this long before a newer alert replaces it.
  double least_show_s = 1.0;
  double hold_after_clear_s = 3.0;  ///< and for this long after the alert is cleared
  double follow_s = 0.2;            ///< time constant with which the look-at point follows the threat
};

/// A hit alert in the form that the view needs.
struct AlertUpdate {
  std::uint32_t alert = 0;
  bool cleared = false;
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d pgv = Eigen::Vector3d::Zero();
  std::uint32_t link = 0;    ///< which threatens to hit
  std::uint16_t object = 0;  ///< this
};

/// Where a link threatens an object now.
struct ThreatPlace {
  std::uint32_t link = 0;
  std::uint16_t object = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in W
  Eigen::Vector3d pgv = Eigen::Vector3d::Zero();         ///< towards the object, in W; 0: no direction
};

/// What the hit-zone view shows now.
struct HitView {
  std::uint32_t alert = 0;   ///< 0: no view
  bool threatening = false;  ///< the alert is not cleared
  std::uint32_t link = 0;    ///< of the alert
  std::uint16_t object = 0;  ///< of the alert
  ViewNode node = ViewNode::kAutomatic;
  ViewSituation situation;
  Eigen::Vector3d eye_m = Eigen::Vector3d::Zero();
  std::optional<ToolGap> approach;  ///< of a contact that is wanted: no alert's zone (ToolApproach)
};

/// Decides which hit zone is shown, and from where (4.2): that of the newest alert, steadily, until some time
/// after the alert was cleared. Its look-at point moves with the threat while that lasts, so that a hand that
/// slides along an object stays in view, and the node is chosen for where it is now. The operator may hold
/// the view and choose the node. Time comes in as dt only. step() allocates nothing.
class SyntheticViewer {
 public:
  explicit SyntheticViewer(const HitViewConfig& config) : config_(config), chooser_(config.choice) {}

  /// Takes a raised or cleared alert. A cleared alert that is not known is ignored.
  void take(const AlertUpdate& update) noexcept;

  /// Takes where links threaten objects now; what the next step() shows follows its own. What is held, or
  /// over, stays where it is. Allocates nothing.
  void follow(std::span<const ThreatPlace> threats) noexcept;

  /// Lets the next step() choose the node freely.
  void choose_anew() noexcept { chooser_.release(); }

  /// Advances by one frame. `hold`: keep the view that is shown; `chosen`: the operator's node, or automatic.
  HitView step(bool hold, ViewNode chosen, const VisibleShare& visible, double dt_s);

 private:
  struct Alert {
    AlertUpdate update;
    bool pending = false;  // raised, and neither shown nor cleared
  };

  static constexpr std::size_t kRemembered = 16;

  HitViewConfig config_;
  ViewChooser chooser_;
  std::optional<AlertUpdate> shown_;   // its place: where the view looks
  std::optional<ThreatPlace> threat_;  // of what is shown, as it is now
  double shown_s_ = 0.0;
  double over_s_ = 0.0;  // since the shown alert was cleared
  std::array<Alert, kRemembered> alerts_{};
  std::size_t next_ = 0;
};

}  // namespace phantom::synthetic_viewer
