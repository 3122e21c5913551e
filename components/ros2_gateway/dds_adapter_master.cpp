#include "components/ros2_gateway/dds_adapter_master.hpp"

#include <atomic>
#include <mutex>
#include <optional>

#include "common/dds/admission/refusal_log.hpp"
#include "common/haptic_device/handle_service.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/words.hpp"
#include "ros2_idl/geometry_msgsPubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

constexpr dds::QosContract kNewestCommand{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

std::array<double, 3> numbers_of(const geometry_msgs::msg::dds_::Vector3_& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

struct MasterInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const MasterRules& rules)
      : frame(rules.frame),
        master(rules.handle),
        service(
            phantom, rules.handle,
            [this](const auto& felt, const robot::Spatial& wrench, double dt_s, core::Nanoseconds now_ns) {
              return step(felt, wrench, dt_s, now_ns);
            },
            [this](const std::string& why) { refusals.refused(why); }) {
    if (!rules.twist_topic.empty())
      twists.emplace(
          node, rules.twist_topic, kNewestCommand,
          [this](const geometry_msgs::msg::dds_::TwistStamped_& m, const dds::SampleInfo& info) {
            return take(m.header(), info, [&](const StreamMessage& from, core::Nanoseconds utc_ns) {
              return master.take_twist(from, numbers_of(m.twist().linear()), numbers_of(m.twist().angular()),
                                       info.received_ns, utc_ns);
            });
          });
    if (!rules.joy_topic.empty())
      joys.emplace(node, rules.joy_topic, kNewestCommand,
                   [this](const sensor_msgs::msg::dds_::Joy_& m, const dds::SampleInfo& info) {
                     return take(m.header(), info, [&](const StreamMessage& from, core::Nanoseconds utc_ns) {
                       return master.take_joy(from, m.axes(), m.buttons(), info.received_ns, utc_ns);
                     });
                   });
  }

  template <class Take>
  bool take(const std_msgs::msg::dds_::Header_& header, const dds::SampleInfo& info, const Take& take_by) {
    core::Status status = core::Status::ok();
    if (!frame.empty() && header.frame_id() != frame)
      status = core::Status::invalid_argument("frame_id '" + header.frame_id().substr(0, 64) +
                                              "'; allowed: '" + frame + "'");
    if (status) {
      const std::lock_guard lock(mutex);
      status = take_by(StreamMessage{ros2::nanoseconds_of(header.stamp()), info.writer}, core::utc_ns());
    }
    ++(status ? heard : refused);
    if (!status) refusals.refused(status.message());
    return static_cast<bool>(status);
  }

  haptic_device::HandleService::Handle step(const haptic_device::HapticClient::Felt& felt,
                                            const robot::Spatial& wrench, double dt_s,
                                            core::Nanoseconds now_ns) {
    leads = felt.leads;
    taken = felt.valid;
    const std::lock_guard lock(mutex);
    const teleop::HandState& hand = master.step(wrench, felt.valid, dt_s, now_ns);
    clutch = hand.clutch;
    return {.hand = hand};
  }

  std::string frame;
  std::mutex mutex;
  TwistMaster master;  // guarded by mutex
  std::atomic<std::uint64_t> heard{0}, refused{0};
  std::atomic<bool> leads{false}, taken{false}, clutch{false};
  dds::RefusalLog refusals{"commands of ROS 2"};
  std::optional<ros2::Subscription<geometry_msgs::msg::dds_::TwistStamped_PubSubType>> twists;
  std::optional<ros2::Subscription<sensor_msgs::msg::dds_::Joy_PubSubType>> joys;
  // Declared last: its thread uses the others.
  haptic_device::HandleService service;
};

MasterInput::MasterInput(dds::Participant& phantom, ros2::Node& node, const MasterRules& rules)
    : impl_(std::make_unique<Impl>(phantom, node, rules)) {}
MasterInput::~MasterInput() = default;

std::uint64_t MasterInput::heard() const { return impl_->heard; }
std::uint64_t MasterInput::refused() const { return impl_->refused; }
std::string MasterInput::sentence() const {
  if (!impl_->taken) return "master_io does not take the commands";
  if (impl_->leads) return "commands lead the tool";
  return impl_->clutch ? "commands come, and master and slave are not coupled" : "no commands";
}

}  // namespace phantom::ros2_gateway
