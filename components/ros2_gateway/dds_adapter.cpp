#include "components/ros2_gateway/dds_adapter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/words.hpp"
#include "components/ros2_gateway/dds_adapter_objects.hpp"
#include "components/ros2_gateway/sensors/dds_adapter_sensors.hpp"
#include "ros2_idl/geometry_msgsPubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

using JointState = sensor_msgs::msg::dds_::JointState_PubSubType;
using WrenchStamped = geometry_msgs::msg::dds_::WrenchStamped_PubSubType;

// The newest alone counts: what is lost is not asked for again.
constexpr dds::QosContract kNewest{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

// A topic of Phantom's is not written more often than this, whatever floods the ROS 2 domain.
constexpr core::Nanoseconds kMinInterval = core::kNsPerMillisecond / 2;

class Pace {
 public:
  bool due() {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (now_ns - last_ns_ < kMinInterval) return false;
    last_ns_ = now_ns;
    return true;
  }

 private:
  core::Nanoseconds last_ns_ = 0;
};

std::array<double, 3> array_of(const geometry_msgs::msg::dds_::Vector3_& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const GatewayConfig& config, const robot::SerialArm& arm,
       const std::string& urdf, OnJointStates on_joint_states)
      : participant("ros2_gateway", network), status(participant), node(config.node) {
    if (!config.joint_states_topic.empty()) {
      slave.emplace(participant, dds::kSlaveState);
      joint_states.emplace(node, config.joint_states_topic, kNewest,
                           [this, on = std::move(on_joint_states)](const JointState::type& message,
                                                                   const dds::SampleInfo& info) {
                             return pass_on(message, info, on);
                           });
    }
    if (!config.wrench_topic.empty()) {
      wrist.emplace(participant, dds::kWristWrench);
      wrench.emplace(
          node, config.wrench_topic, kNewest,
          [this, frame = config.wrench_frame](const WrenchStamped::type& message, const dds::SampleInfo&) {
            return pass_on(message, frame);
          });
    }
    if (!config.collision_objects_topic.empty())
      objects.emplace(participant, node, config.collision_objects_topic, config.out.world);
    if (!config.master.twist_topic.empty() || !config.master.joy_topic.empty())
      master.emplace(participant, node, config.master);
    if (!config.points.cloud.empty() || !config.points.depth.empty())
      points = open_points(participant, node, config.points);
    for (const DepthCameraRules& rules : config.depth_cameras)
      depth_cameras.push_back(open_depth_camera(participant, node, rules));
    if (config.camera.wanted()) camera = open_camera(participant, node, config.camera);
    if (config.out.rate_Hz > 0.0 && (config.workspace.meshes || !config.workspace.clouds.empty()))
      workspace.emplace(participant, node, arm, config.out, config.workspace);
    if (config.out.rate_Hz > 0.0) outputs.emplace(participant, node, arm, config.out, urdf);
    status.count_refusals_of(node.participant());
  }

  bool pass_on(const JointState::type& message, const dds::SampleInfo& info,
               const OnJointStates& on_joint_states) {
    const JointStateMessage given{.stamp_ns = ros2::nanoseconds_of(message.header().stamp()),
                                  .publisher = info.writer,
                                  .name = message.name(),
                                  .position = message.position(),
                                  .velocity = message.velocity()};
    messages::SlaveState state;
    const auto complete = on_joint_states(given, state);
    if (complete && *complete && arm_pace.due()) slave->publish(state);
    return complete.has_value();
  }

  bool pass_on(const WrenchStamped::type& message, const std::string& frame) {
    if (!frame.empty() && message.header().frame_id() != frame) return false;
    messages::WristWrench made;
    made.force_N = array_of(message.wrench().force());
    made.torque_Nm = array_of(message.wrench().torque());
    const auto finite = [](const auto& v) {
      return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
    };
    made.valid = finite(made.force_N) && finite(made.torque_Nm);
    if (made.valid && wrench_pace.due()) wrist->publish(made);
    return made.valid;
  }

  dds::Participant participant;
  messages::StatusReporter status;
  ros2::Node node;
  std::optional<messages::Publisher<messages::SlaveState>> slave;
  std::optional<ros2::Subscription<JointState>> joint_states;
  std::optional<messages::Publisher<messages::WristWrench>> wrist;
  std::optional<ros2::Subscription<WrenchStamped>> wrench;
  Pace arm_pace, wrench_pace;
  std::optional<CollisionObjects> objects;
  std::optional<MasterInput> master;
  std::unique_ptr<SensorInput> points;
  std::vector<std::unique_ptr<SensorInput>> depth_cameras;
  std::unique_ptr<SensorInput> camera;
  std::optional<WorkspaceOutputs> workspace;
  std::optional<Outputs> outputs;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const GatewayConfig& config,
                       const robot::SerialArm& arm, const std::string& urdf, OnJointStates on_joint_states)
    : impl_(std::make_unique<Impl>(network, config, arm, urdf, std::move(on_joint_states))) {}
DdsAdapter::~DdsAdapter() = default;

std::uint32_t DdsAdapter::robots() const { return impl_->joint_states ? impl_->joint_states->matched() : 0; }
void DdsAdapter::publish(bool diagnostics) {
  if (impl_->outputs) impl_->outputs->publish(diagnostics);
}
void DdsAdapter::report(core::Health health) {
  if (impl_->objects) {
    health.figures.push_back({"collision objects", static_cast<double>(impl_->objects->done()), ""});
    health.figures.push_back(
        {"collision objects refused", static_cast<double>(impl_->objects->refused()), ""});
  }
  if (impl_->master) {
    health.figures.push_back({"commands", static_cast<double>(impl_->master->heard()), ""});
    health.figures.push_back({"commands refused", static_cast<double>(impl_->master->refused()), ""});
    health.message += (health.message.empty() ? "" : "; ") + impl_->master->sentence();
  }
  if (impl_->points) {
    health.figures.push_back({"sensor points", static_cast<double>(impl_->points->handed_on()), ""});
    health.figures.push_back({"sensor points refused", static_cast<double>(impl_->points->refused()), ""});
  }
  if (!impl_->depth_cameras.empty()) {
    double handed_on = 0.0, refused = 0.0;
    for (const auto& camera : impl_->depth_cameras) {
      handed_on += static_cast<double>(camera->handed_on());
      refused += static_cast<double>(camera->refused());
    }
    health.figures.push_back({"depth images", handed_on, ""});
    health.figures.push_back({"depth images refused", refused, ""});
  }
  if (impl_->camera) {
    health.figures.push_back({"camera pictures", static_cast<double>(impl_->camera->handed_on()), ""});
    health.figures.push_back({"camera pictures refused", static_cast<double>(impl_->camera->refused()), ""});
  }
  impl_->status.publish(health);
}

}  // namespace phantom::ros2_gateway
