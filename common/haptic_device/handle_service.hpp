#pragma once

#include <functional>
#include <thread>

#include "common/haptic_device/haptic_client.hpp"
#include "common/teleop/coupling/cartesian_hand.hpp"
#include "common/teleop/coupling/free_handle.hpp"

namespace phantom::haptic_device {

/// Serves a handle that no device has (teleop::FreeHandle) as the haptic device of who leads the arm without
/// one: a thread of its own moves it every 2 ms and sends how it stands.
class HandleService {
 public:
  struct Handle {
    teleop::HandState hand;      ///< in D; not valid: the device is not ready
    double grip_opening = -1.0;  ///< 0 to 1; −1: it has no grip
  };
  /// Moves the handle on by `dt_s` under `wrench` (N, N·m, in D, at H's origin). Called by the thread.
  using Step = std::function<Handle(const HapticClient::Felt& felt, const robot::Spatial& wrench, double dt_s,
                                    core::Nanoseconds now_ns)>;
  /// Takes why a state could not be sent. Called by the thread.
  using OnRefusal = std::function<void(const std::string&)>;

  /// Throws dds::DdsError. `participant` must outlive it.
  HandleService(dds::Participant& participant, const teleop::FreeHandleParameters& handle, Step step,
                OnRefusal on_refusal);

 private:
  void run(const std::stop_token& stop);
  void turn(double dt_s, core::Nanoseconds now_ns);

  messages::HapticAbilities able_;
  Step step_;
  OnRefusal on_refusal_;
  HapticClient client_;
  std::jthread thread_;
};

}  // namespace phantom::haptic_device
