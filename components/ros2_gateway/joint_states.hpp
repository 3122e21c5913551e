#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::ros2_gateway {

/// A sensor_msgs/msg/JointState as it came. Velocities and efforts may be left out.
struct JointStateMessage {
  core::Nanoseconds stamp_ns = 0;            ///< since 1970, by the sender's clock; 0: none
  std::array<std::uint8_t, 12> publisher{};  ///< GUID prefix of its participant
  std::span<const std::string> name;
  std::span<const double> position, velocity;
};

/// What is demanded of messages.
struct JointStatesRules {
  double staleness_s = 0.1;          ///< a joint that was not heard for so long has no position
  double largest_stamp_age_s = 0.5;  ///< late or early, by this host's clock; 0: not judged
  double velocity_filter_s = 0.01;   ///< time constant of velocities made of positions
};

/// Makes an arm's state of JointState messages. Each may hold any of its joints, and joints of others.
/// A message's velocities are used; where it has none they are the first differences of the positions by the
/// stamps (by arrival if it has none), through a low-pass of the first order: they lag by half the messages'
/// period and the filter's time constant. Not thread-safe; allocates nothing if the message is sound.
class JointStates {
 public:
  /// `names`: of each joint of the arm in messages.
  JointStates(const robot::SerialArm& arm, std::vector<std::string> names, const JointStatesRules& rules);

  /// Takes a message that arrived at `now_ns` (monotonic; `utc_now_ns` is the same time since 1970). Returns
  /// whether `state` is now the arm's: every joint has been heard within staleness_s. A message is refused
  /// whole, with the reason: lists of different lengths, a number that is none, a position farther beyond the
  /// limits than robot::near_limits, a stamp too far from this host's clock, or one that is not newer than
  /// the last of the same joint, or a joint that another publisher sends, too, and was heard of within
  /// staleness_s; after kRun stamps that are not newer, in a row, each newer than the one before, the
  /// sender's clock is taken to have been set.
  core::Expected<bool> accept(const JointStateMessage& message, core::Nanoseconds now_ns,
                              core::Nanoseconds utc_now_ns, messages::SlaveState& state);
  /// Returns the joints that were not heard for staleness_s, as "elbow, wrist"; empty if none.
  std::string missing(core::Nanoseconds now_ns) const;

  static constexpr int kRun = 8;

 private:
  struct Heard {
    core::Nanoseconds at_ns = 0;     // monotonic; 0: never
    core::Nanoseconds stamp_ns = 0;  // 0: none
    std::array<std::uint8_t, 12> publisher{};
    double position = 0.0, velocity = 0.0;
  };
  core::Status check(const JointStateMessage& message, core::Nanoseconds now_ns,
                     core::Nanoseconds utc_now_ns) const;
  bool in_order(const JointStateMessage& message);
  void take(std::size_t joint, double position, const double* velocity, const JointStateMessage& message,
            core::Nanoseconds now_ns);
  bool fresh(const Heard& heard, core::Nanoseconds now_ns) const;

  robot::SerialArm arm_;
  JointStatesRules rules_;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t, std::less<>> joint_of_;
  std::vector<Heard> heard_;
  core::Nanoseconds refused_stamp_ns_ = 0;
  int run_ = 0;
};

}  // namespace phantom::ros2_gateway
