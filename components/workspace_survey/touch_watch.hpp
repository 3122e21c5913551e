#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/survey/touch.hpp"

namespace phantom::workspace_survey {

struct TouchWatchOptions {
  /// Radius of the probing tool's ball, whose centre is the arm's tip frame. None: no such tool is mounted,
  /// and contacts count where slave_state says that they are.
  std::optional<double> tip_radius_m;
  double sigma_m = 0.0005;  ///< of a ball's or point's distance from what it touches
};

/// What became of a contact.
struct FeltContact {
  std::optional<survey::Touch> touch;  ///< none: it cannot be used
  std::string refusal;                 ///< why
};

/// Finds touches in the states of an arm: one for each time that contact begins after the arm was free for a
/// while. Place and direction are those of the contact's first moments, before anything slides. The direction
/// is that of the force that explains the joints' external torques, if one does. One thread; allocates; fit
/// for the middleware's.
class TouchWatch {
 public:
  /// `arm` must outlive the watch.
  TouchWatch(const robot::SerialArm& arm, const TouchWatchOptions& options);

  /// Takes the next state. `object`: the id of the object that is touched on purpose; contacts that
  /// slave_state says to be of another are refused. Returns a contact once enough of it was felt.
  std::optional<FeltContact> take(const messages::SlaveState& state, double now_s, std::uint16_t object);
  /// Returns where the ball is, if a tool is mounted and the newest state had no contact.
  std::optional<survey::FreePlace> free_place() const;

 private:
  struct Beginning {
    double since_s = 0.0;
    survey::Touch touch;
    Eigen::Vector3d force_sum_N = Eigen::Vector3d::Zero();
    std::string refusal;
  };
  Beginning begin(const messages::SlaveState& state, double now_s, std::uint16_t object) const;
  Eigen::Vector3d force_W_N(const messages::SlaveState& state, const Eigen::Vector3d& p_W_m) const;

  const robot::SerialArm& arm_;
  TouchWatchOptions options_;
  robot::LinkPoses X_WL_;
  std::optional<Beginning> beginning_;
  bool handled_ = true;  // the present contact is handed out; at first, as one that began unseen is no touch
  double free_since_s_ = -1.0;
  Eigen::Vector3d tip_W_m_ = Eigen::Vector3d::Zero();
  bool touching_ = true;
};

}  // namespace phantom::workspace_survey
