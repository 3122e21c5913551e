#pragma once

#include <array>
#include <string>
#include <thread>

#include "common/core/snapshot.hpp"
#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/runtime/process/wake_signal.hpp"

namespace phantom::haptic_device {

/// The device's side of the topics haptic_device and haptic_device_wrench (docs/haptic_device.md). One
/// thread; another, of its own, stands between it and DDS, whose writers may block.
class HapticClient {
 public:
  /// What the device is to exert now, faded already if it is old, in D, at H's origin.
  struct Felt {
    std::array<double, 3> force_N{}, moment_N_m{};
    bool valid = false;      ///< Phantom takes the device
    bool leads = false;      ///< the hand leads the tool
    double age_s = -1.0;     ///< since its receipt; −1: none yet
    double answer_s = -1.0;  ///< from the measurement that it answers to its receipt; −1: none of ours
  };

  /// Throws dds::DdsError. `participant` must outlive it.
  explicit HapticClient(dds::Participant& participant);
  ~HapticClient();

  /// Call it once a period, before send(): the state that is sent then says that this wrench acted. Never
  /// blocks; allocates nothing.
  Felt receive();
  /// Hands on a state that was measured just now; `orientation_xyzw` is that of the handle, whatever
  /// state.handle has. Refuses a value out of its range or none: nothing is sent then. Never blocks;
  /// allocates in refusals only.
  core::Status send(messages::HapticDevice state, const std::array<double, 4>& orientation_xyzw);

 private:
  using Wrench = messages::Received<messages::HapticDeviceWrench>;
  void send_all(const std::stop_token& stop);
  void look(core::Nanoseconds now_ns);
  bool is_for_us(const Wrench& wrench) const;
  double share(core::Nanoseconds now_ns) const;

  core::Snapshot<Wrench> inbox_;
  core::Snapshot<messages::HapticDevice> outbox_;
  runtime::WakeSignal wake_;
  Wrench exerted_, heard_;  // the newest valid one, and the newest
  core::Nanoseconds fades_from_ns_ = 0;
  dds::Participant& participant_;
  dds::Stamper stamper_;
  dds::Writer<msg::HapticDevice> writer_;
  messages::TopicSubscriber<msg::HapticDeviceWrench> reader_;
  std::jthread sender_;
};

}  // namespace phantom::haptic_device
