#include "components/ros2_gateway/dds_adapter_out.hpp"

#include "common/core/clock.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/status_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/ros2/from_phantom.hpp"

namespace phantom::ros2_gateway {
namespace {

/// The newest sample of a topic, until it is taken.
template <class Message, class Sample>
class Newest {
 public:
  Newest(dds::Participant& participant, const dds::TopicSpec<Message>& topic, const messages::ArmBounds& arm)
      : reader_(participant, topic, arm, [this](const Sample& sample, core::Nanoseconds) {
          const std::lock_guard lock(mutex_);
          newest_ = sample;
        }) {}
  std::optional<Sample> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(newest_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<Sample> newest_;
  messages::CheckedReader<Message> reader_;
};

}  // namespace

struct Outputs::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm, const OutputRules& rules,
       const std::string& urdf)
      : words(arm, rules),
        slave(phantom, dds::kSlaveState, messages::bounds_of(arm)),
        master(phantom, dds::kMasterState, messages::bounds_of(arm)),
        percept(phantom, dds::kPercept, messages::bounds_of(arm)),
        alerts(phantom, dds::kHitAlert, messages::bounds_of(arm)),
        components(phantom, dds::kComponentStatus,
                   [this](const msg::ComponentStatus& status, const dds::SampleInfo& info) {
                     const auto read = messages::from_idl(status);
                     if (!read) return false;
                     const std::lock_guard lock(mutex);
                     states.hear(*read, info.received_ns);
                     return true;
                   }),
        out(node, ros2::FromPhantomTopics(rules.prefix)) {
    out.fixed_transforms.publish(words.fixed_transforms(core::utc_ns()));
    if (!urdf.empty()) out.description.publish(ros2::text_message(urdf));
  }

  void publish_slave(const messages::SlaveState& state) {
    const core::Nanoseconds utc_ns = core::utc_ns();
    out.slave.publish(words.joints(state, utc_ns));
    out.transforms.publish(words.transforms(state, utc_ns));
  }

  void publish_percept(const messages::Percept& felt) {
    const core::Nanoseconds utc_ns = core::utc_ns();
    out.closeness.publish(words.closeness(felt));
    out.speed.publish(words.speed(felt));
    if (felt.valid) out.drag.publish(words.drag(felt, utc_ns));
    out.worst_place.publish(words.worst_place(felt, utc_ns));
  }

  void publish_diagnostics() {
    const auto alert = alerts.take();
    std::unique_lock lock(mutex);
    if (alert) states.hear(*alert);
    const auto message = states.message(core::monotonic_ns(), core::utc_ns());
    lock.unlock();
    out.diagnostics.publish(message);
  }

  struct Publishers {
    Publishers(ros2::Node& node, const ros2::FromPhantomTopics& topics)
        : slave(node, topics.slave),
          master(node, topics.master),
          drag(node, topics.drag),
          closeness(node, topics.closeness),
          speed(node, topics.speed),
          worst_place(node, topics.worst_place),
          transforms(node, topics.transforms),
          fixed_transforms(node, topics.fixed_transforms),
          diagnostics(node, topics.diagnostics),
          description(node, topics.description) {}
    using Topics = ros2::FromPhantomTopics;
    ros2::Publisher<Topics::JointState> slave, master, drag;
    ros2::Publisher<Topics::Float64> closeness, speed;
    ros2::Publisher<visualization_msgs::msg::dds_::Marker_PubSubType> worst_place;
    ros2::Publisher<Topics::TfMessage> transforms, fixed_transforms;
    ros2::Publisher<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType> diagnostics;
    ros2::Publisher<std_msgs::msg::dds_::String_PubSubType> description;
  };

  const ros2::FromPhantom words;
  std::mutex mutex;
  ros2::Diagnostics states;

  Newest<msg::SlaveState, messages::SlaveState> slave;
  Newest<msg::MasterState, messages::MasterState> master;
  Newest<msg::Percept, messages::Percept> percept;
  Newest<msg::HitAlert, messages::HitAlert> alerts;
  dds::Reader<msg::ComponentStatus> components;
  Publishers out;
};

Outputs::Outputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm,
                 const OutputRules& rules, const std::string& urdf)
    : impl_(std::make_unique<Impl>(phantom, node, arm, rules, urdf)) {}
Outputs::~Outputs() = default;

void Outputs::publish(bool diagnostics) {
  if (const auto state = impl_->slave.take()) impl_->publish_slave(*state);
  if (const auto state = impl_->master.take())
    impl_->out.master.publish(impl_->words.joints(*state, core::utc_ns()));
  if (const auto felt = impl_->percept.take()) impl_->publish_percept(*felt);
  if (diagnostics) impl_->publish_diagnostics();
}

}  // namespace phantom::ros2_gateway
