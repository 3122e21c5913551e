#include "components/ros2_gateway/dds_adapter_master.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "common/dds/refusal_log.hpp"
#include "common/haptic_device/haptic_client.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/words.hpp"
#include "ros2_idl/geometry_msgsPubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

constexpr std::chrono::microseconds kHandlePeriod{2000};
constexpr double kLongestStep_s = 0.05;  // after a hold-up the handle does not leap
constexpr dds::QosContract kNewestCommand{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

messages::HapticAbilities abilities_of(const TwistMasterRules& rules) {
  return {.measured_axes = messages::kAllAxes,
          .actuated_axes = messages::kAllAxes,
          .max_force_N = 1000.0,  // a simulated handle has no motors that tire
          .max_moment_N_m = 100.0,
          .mass_kg = rules.mass_kg,
          .inertia_kg_m2 = rules.inertia_kg_m2,
          .workspace_m = TwistMaster::kWay_m,
          .workspace_rad = 10.0,
          .period_s = 1e-6 * static_cast<double>(kHandlePeriod.count())};
}

std::array<double, 3> numbers_of(const geometry_msgs::msg::dds_::Vector3_& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

struct MasterInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const MasterRules& rules)
      : frame(rules.frame), able(abilities_of(rules.handle)), master(rules.handle), client(phantom) {
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
    thread = std::jthread([this](const std::stop_token& stop) { run(stop); });
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

  void run(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    core::Nanoseconds last_ns = core::monotonic_ns();
    while (!stop.stop_requested()) {
      due = std::max(due + kHandlePeriod, std::chrono::steady_clock::now());
      std::this_thread::sleep_until(due);
      const core::Nanoseconds now_ns = core::monotonic_ns();
      step(std::min(core::seconds(now_ns - last_ns), kLongestStep_s), now_ns);
      last_ns = now_ns;
    }
  }
  void step(double dt_s, core::Nanoseconds now_ns) {
    const auto felt = client.receive();
    robot::Spatial wrench;
    wrench << Eigen::Vector3d(felt.force_N.data()), Eigen::Vector3d(felt.moment_N_m.data());
    TwistMaster::Handle handle;
    {
      const std::lock_guard lock(mutex);
      handle = master.step(wrench, felt.valid, dt_s, now_ns);
    }
    leads = felt.leads;
    taken = felt.valid;
    clutch = handle.clutch;
    messages::HapticDevice state;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      state.handle.position_m[i] = handle.X_DH.translation_m[row];
      state.handle.velocity_m_s[i] = handle.twist[row];
      state.handle.angular_velocity_rad_s[i] = handle.twist[row + 3];
    }
    state.ready = true;
    state.clutch = handle.clutch;
    state.able = able;
    const Eigen::Vector4d q = geometry::quaternion_xyzw(handle.X_DH.rotation);
    if (const core::Status sent = client.send(state, {q[0], q[1], q[2], q[3]}); !sent)
      refusals.refused(sent.message());
  }

  std::string frame;
  messages::HapticAbilities able;
  std::mutex mutex;
  TwistMaster master;  // guarded by mutex
  std::atomic<std::uint64_t> heard{0}, refused{0};
  std::atomic<bool> leads{false}, taken{false}, clutch{false};
  dds::RefusalLog refusals{"commands of ROS 2"};
  haptic_device::HapticClient client;
  std::optional<ros2::Subscription<geometry_msgs::msg::dds_::TwistStamped_PubSubType>> twists;
  std::optional<ros2::Subscription<sensor_msgs::msg::dds_::Joy_PubSubType>> joys;
  std::jthread thread;
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
