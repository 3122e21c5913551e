#include "components/ros2_gateway/dds_adapter_out.hpp"

#include <array>

#include "common/core/clock.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/ros2/from_phantom.hpp"
#include "common/ros2/words.hpp"

namespace phantom::ros2_gateway {
namespace {

using Image = sensor_msgs::msg::dds_::CompressedImage_PubSubType;
constexpr std::array kViewNames{"main", "hit", "tool", "camera"};  // by messages::PictureView

/// The newest sample of a topic, until it is taken.
template <class Message, class Sample>
class Newest {
 public:
  Newest(dds::Participant& participant, const dds::TopicSpec<Message>& topic, const messages::ArmBounds& arm)
      : reader_(participant, topic, arm, [this](const messages::Received<Sample>& sample) {
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
  messages::TopicSubscriber<Message> reader_;
};

}  // namespace

struct Outputs::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm, const OutputRules& names,
       const std::string& urdf)
      : rules(names),
        words(arm, rules),
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
    if (rules.views) hear_pictures(phantom, node);
  }

  /// Each view's newest picture waits for publish().
  void hear_pictures(dds::Participant& phantom, ros2::Node& node) {
    for (std::size_t view = 0; view < kViewNames.size(); ++view)
      views[view].emplace(node, rules.prefix + "/views/" + kViewNames[view] + "/compressed", ros2::kDefault);
    pictures.emplace(phantom, dds::kViewPicture, messages::ArmBounds(),
                     [this](const messages::Received<messages::ViewPicture>& picture) {
                       const std::lock_guard lock(mutex);
                       newest_pictures[static_cast<std::size_t>(picture.view)] = picture.jpeg;
                     });
  }
  void publish_views() {
    for (std::size_t view = 0; view < kViewNames.size(); ++view) {
      Image::type image;
      {
        const std::lock_guard lock(mutex);
        if (newest_pictures[view].empty()) continue;
        image.data(std::exchange(newest_pictures[view], {}));
      }
      image.header(ros2::header(rules.frame_prefix + "view_" + kViewNames[view], core::utc_ns()));
      image.format("jpeg");
      views[view]->publish(image);
    }
  }

  void publish_slave(const messages::SlaveState& state) {
    const core::Nanoseconds utc_ns = core::utc_ns();
    slave_position = state.position;
    out.slave.publish(words.joints(state, utc_ns));
    out.transforms.publish(words.transforms(state, utc_ns));
  }

  void publish_master(const messages::MasterState& state) {
    const core::Nanoseconds utc_ns = core::utc_ns();
    out.master.publish(words.joints(state, utc_ns));
    out.torque_wrench.publish(words.wrench(state.position, state.percept_torque_Nm, utc_ns));
  }

  void publish_percept(const messages::Percept& felt) {
    const core::Nanoseconds utc_ns = core::utc_ns();
    out.closeness.publish(words.closeness(felt));
    out.speed.publish(words.speed(felt));
    if (felt.valid) out.drag.publish(words.drag(felt, utc_ns));
    if (felt.valid && slave_position)
      out.drag_wrench.publish(words.wrench(*slave_position, felt.drag_torque_Nm, utc_ns));
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
          drag_wrench(node, topics.drag_wrench),
          torque_wrench(node, topics.torque_wrench),
          closeness(node, topics.closeness),
          speed(node, topics.speed),
          worst_place(node, topics.worst_place),
          transforms(node, topics.transforms),
          fixed_transforms(node, topics.fixed_transforms),
          diagnostics(node, topics.diagnostics),
          description(node, topics.description) {}
    using Topics = ros2::FromPhantomTopics;
    ros2::Publisher<Topics::JointState> slave, master, drag;
    ros2::Publisher<geometry_msgs::msg::dds_::WrenchStamped_PubSubType> drag_wrench, torque_wrench;
    ros2::Publisher<Topics::Float64> closeness, speed;
    ros2::Publisher<visualization_msgs::msg::dds_::Marker_PubSubType> worst_place;
    ros2::Publisher<Topics::TfMessage> transforms, fixed_transforms;
    ros2::Publisher<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType> diagnostics;
    ros2::Publisher<std_msgs::msg::dds_::String_PubSubType> description;
  };

  const OutputRules rules;
  const ros2::FromPhantom words;
  std::mutex mutex;
  ros2::Diagnostics states;
  std::optional<core::JointArray> slave_position;  // as published last
  std::array<std::vector<std::uint8_t>, kViewNames.size()> newest_pictures;

  Newest<msg::SlaveState, messages::SlaveState> slave;
  Newest<msg::MasterState, messages::MasterState> master;
  Newest<msg::Percept, messages::Percept> percept;
  Newest<msg::HitAlert, messages::HitAlert> alerts;
  dds::Reader<msg::ComponentStatus> components;
  Publishers out;
  std::array<std::optional<ros2::Publisher<Image>>, kViewNames.size()> views;
  std::optional<messages::TopicSubscriber<msg::ViewPicture>> pictures;
};

Outputs::Outputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm,
                 const OutputRules& rules, const std::string& urdf)
    : impl_(std::make_unique<Impl>(phantom, node, arm, rules, urdf)) {}
Outputs::~Outputs() = default;

void Outputs::publish(bool diagnostics) {
  if (const auto state = impl_->slave.take()) impl_->publish_slave(*state);
  if (const auto state = impl_->master.take()) impl_->publish_master(*state);
  if (const auto felt = impl_->percept.take()) impl_->publish_percept(*felt);
  if (impl_->pictures) impl_->publish_views();
  if (diagnostics) impl_->publish_diagnostics();
}

}  // namespace phantom::ros2_gateway
