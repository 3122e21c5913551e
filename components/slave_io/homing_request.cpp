#include "components/slave_io/homing_request.hpp"

namespace phantom::slave_io {

core::Status HomingRequest::ask() {
  switch (state_.load(std::memory_order_acquire)) {
    case State::kNotNeeded:
      return core::Status::invalid_argument("home: no drive has to be homed");
    case State::kNotYet:
      return core::Status::invalid_argument(
          "home: the drives are not ready yet; allowed: once slave_io names who has to be homed");
    case State::kStopped:
      return core::Status::invalid_argument("home: the arm is stopped; allowed: after a reset");
    case State::kWithheld:
      return core::Status::invalid_argument(
          "home: an enabling switch is released; allowed: while it is held");
    case State::kRuns:
      return core::Status::invalid_argument("home: the drives are being homed already");
    case State::kPossible:
      break;
  }
  requested_.store(true, std::memory_order_release);
  return core::Status::ok();
}

}  // namespace phantom::slave_io
