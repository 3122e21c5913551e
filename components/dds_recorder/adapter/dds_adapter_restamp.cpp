#include "components/dds_recorder/adapter/dds_adapter_restamp.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/core/elapsed.hpp"
#include "common/dds/endpoints/cdr.hpp"

namespace phantom::dds_recorder {
namespace {

/// The project's topics whose samples have a stamp.
const auto& stamped_topics() {
  static const auto topics = std::tie(
      dds::kMasterState, dds::kSlaveState, dds::kGripperState, dds::kDragField, dds::kPercept,
      dds::kInterestPoints, dds::kSkinPercept, dds::kHitAlert, dds::kModelDoubt, dds::kSensingCommand,
      dds::kSensingReply, dds::kOperatorCommand, dds::kRecordingRequest, dds::kOperatorReply,
      dds::kWristWrench, dds::kViewPicture, dds::kCameraPicture, dds::kSensorPoints, dds::kDepthImage,
      dds::kOccupancyChange, dds::kSpaceView, dds::kViewPose, dds::kHapticDevice, dds::kHapticDeviceWrench,
      dds::kWorkspaceCommand, dds::kWorkspaceReply, dds::kComponentStatus);
  return topics;
}

template <class T>
void move_all(T& sample, Restamper& restamper) {
  restamper.move(sample.stamp());
  if constexpr (requires { sample.slave_echo(); }) restamper.move(sample.slave_echo());
  if constexpr (requires { sample.master_echo(); }) restamper.move(sample.master_echo());
  if constexpr (requires { sample.drag_echo(); }) restamper.move(sample.drag_echo());
  if constexpr (requires { sample.wrench_echo(); }) restamper.move(sample.wrench_echo());
  if constexpr (requires { sample.device_echo(); }) restamper.move(sample.device_echo());
  if constexpr (requires { sample.command(); }) restamper.move(sample.command());
}

template <class T>
bool restamp_as(const dds::TopicSpec<T>& topic, Restamper& restamper, std::vector<std::uint8_t>& bytes) {
  const dds::CdrCodec codec(topic);
  T sample;
  if (!codec.decode(bytes, &sample)) return false;
  move_all(sample, restamper);
  return codec.encode(&sample, bytes);
}

std::uint64_t mixed(std::uint64_t value) {  // splitmix64's finaliser
  value ^= value >> 30;
  value *= 0xbf58476d1ce4e5b9U;
  value ^= value >> 27;
  value *= 0x94d049bb133111ebU;
  return value ^ value >> 31;
}

}  // namespace

void Restamper::begin(core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns) {
  ++turn_;
  utc_minus_monotonic_ns_ = utc_now_ns - now_ns;
  due_ns_ = now_ns;
}

std::uint64_t Restamper::added(const Session& session) const {
  return session.added + (turn_ - session.turn) * (session.greatest - session.least + 1);
}

std::uint64_t Restamper::renamed(std::uint64_t session) const { return mixed(session ^ session_) | 1U; }

core::Nanoseconds Restamper::moved(const Session& session, core::Nanoseconds recorded_ns) const {
  constexpr double kMax_ns = 4e18;  // a recorded reading may be anything; this plus a clock reading fits
  const double apart_ns = static_cast<double>(core::elapsed_ns(session.recorded_ns, recorded_ns)) / rate_;
  return session.now_ns + std::llround(std::clamp(apart_ns, -kMax_ns, kMax_ns));
}

void Restamper::move(msg::Stamp& stamp) {
  const auto [session, fresh] = sessions_.find_or_add(stamp.session());
  if (fresh || session.turn != turn_) {
    if (!fresh) session.added = added(session);
    session.turn = turn_;
    session.recorded_ns = stamp.monotonic_ns();
    session.now_ns = due_ns_;
  }
  session.least = fresh ? stamp.sequence_number() : std::min(session.least, stamp.sequence_number());
  session.greatest = std::max(session.greatest, stamp.sequence_number());
  stamp.session(renamed(stamp.session()));
  if (stamp.sequence_number() != 0) stamp.sequence_number(stamp.sequence_number() + session.added);
  stamp.monotonic_ns(moved(session, stamp.monotonic_ns()));
  stamp.utc_ns(stamp.monotonic_ns() + utc_minus_monotonic_ns_);
}

void Restamper::move(msg::Echo& echo) const {
  const Session* known = sessions_.find(echo.session());
  if (echo.sequence_number() == 0 || known == nullptr) return;
  echo.session(renamed(echo.session()));
  echo.sequence_number(echo.sequence_number() + added(*known));
  echo.monotonic_ns(moved(*known, echo.monotonic_ns()));
}

bool Restamper::restamp(const dds::TopicDescription& topic, core::Nanoseconds due_ns,
                        std::vector<std::uint8_t>& bytes) {
  due_ns_ = due_ns;
  bool done = false;
  std::apply(
      [&](const auto&... spec) {
        ((&topic == &spec && (done = restamp_as(spec, *this, bytes), true)) || ...);
      },
      stamped_topics());
  return done;
}

}  // namespace phantom::dds_recorder
