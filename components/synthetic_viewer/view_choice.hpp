#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "common/percept/view_node.hpp"

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

}  // namespace phantom::synthetic_viewer
