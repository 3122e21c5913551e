#include "components/ros2_gateway/service.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>

#include "common/runtime/process/process.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"

namespace phantom::ros2_gateway {
namespace {

constexpr double kStatusPeriod_s = 0.5;
constexpr double kDiagnosticsPeriod_s = 1.0;

/// What of the robot's messages is told: between the middleware's thread and the one that reports.
class Robot {
 public:
  Robot(const robot::SerialArm& arm, const GatewayConfig& config)
      : joints_(arm, message_names(config, arm), config.joint_states) {}

  core::Expected<bool> take(const JointStateMessage& message, messages::SlaveState& state) {
    const std::lock_guard lock(mutex_);
    auto complete = joints_.accept(message, core::monotonic_ns(), core::utc_ns(), state);
    ++(complete ? heard_ : refused_);
    if (!complete) {
      reason_ = complete.status().message();
      refused_at_ns_ = core::monotonic_ns();
    }
    passed_on_ += complete && *complete ? 1 : 0;
    return complete;
  }

  core::Health health(std::uint32_t robots) {
    const std::lock_guard lock(mutex_);
    const core::Nanoseconds now_ns = core::monotonic_ns();
    core::Health health;
    const std::string missing = joints_.missing(now_ns);
    const bool refuses = refused_at_ns_ != 0 && core::seconds(now_ns - refused_at_ns_) < 2.0;
    if (missing.empty()) {
      health.state = refuses ? core::ComponentState::kDegraded : core::ComponentState::kRunning;
      if (refuses) health.message = "messages are refused: " + reason_;
    } else if (passed_on_ == 0) {
      health.state = core::ComponentState::kReady;
      health.message = robots == 0 ? "waiting for a robot: no publisher of joint_states"
                       : refuses   ? "messages are refused: " + reason_
                                   : "waiting for joints: " + missing;
    } else {
      health.state = core::ComponentState::kDegraded;
      health.message = refuses ? "messages are refused: " + reason_ : "joints without a state: " + missing;
    }
    health.figures = {{"joint_states", static_cast<double>(heard_), ""},
                      {"refused", static_cast<double>(refused_), ""},
                      {"passed on", static_cast<double>(passed_on_), ""}};
    return health;
  }

 private:
  std::mutex mutex_;
  JointStates joints_;
  std::uint64_t heard_ = 0, refused_ = 0, passed_on_ = 0;
  std::string reason_;
  core::Nanoseconds refused_at_ns_ = 0;
};

}  // namespace

int run_service(const runtime::Deployment& deployment, const GatewayConfig& config,
                const robot::SerialArm& arm, const std::string& urdf) {
  const bool hears = !config.joint_states_topic.empty();
  Robot robot(arm, config);
  DdsAdapter adapter(deployment.network, config, arm, urdf,
                     [&robot](const JointStateMessage& message, messages::SlaveState& state) {
                       return robot.take(message, state);
                     });
  spdlog::info(
      "node /{} of ROS 2 domain {}; {}", config.node.name, config.node.domain,
      hears ? "the arm is the robot that publishes " + config.joint_states_topic : "no robot is heard");
  const double period_s =
      config.out.rate_Hz > 0.0 ? std::min(1.0 / config.out.rate_Hz, kStatusPeriod_s) : kStatusPeriod_s;
  std::string last;
  core::Nanoseconds status_due_ns = 0, diagnostics_due_ns = 0;
  do {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const bool diagnostics = now_ns >= diagnostics_due_ns;
    adapter.publish(diagnostics);
    if (diagnostics) diagnostics_due_ns = now_ns + core::from_seconds(kDiagnosticsPeriod_s);
    if (now_ns < status_due_ns) continue;
    status_due_ns = now_ns + core::from_seconds(kStatusPeriod_s);
    core::Health health = robot.health(adapter.robots());
    if (!hears) health = {.state = core::ComponentState::kRunning};
    if (health.message != last) {
      const bool bad = health.state == core::ComponentState::kDegraded;
      spdlog::log(bad ? spdlog::level::warn : spdlog::level::info, "{}",
                  health.message.empty() ? "the arm's pose is passed on" : health.message);
      last = health.message;
    }
    adapter.report(health);
  } while (runtime::sleep_unless_stopped(period_s));
  adapter.report({.state = core::ComponentState::kStopped, .message = "ended in order"});
  return runtime::kExitDone;
}

}  // namespace phantom::ros2_gateway
