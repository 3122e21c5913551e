#include "common/messages/living.hpp"

namespace phantom::messages {

const char* name_of(DepthCameraState state) noexcept {
  switch (state) {
    case DepthCameraState::kWaiting:
      return "waiting";
    case DepthCameraState::kLive:
      return "live";
    case DepthCameraState::kLate:
      return "late";
    case DepthCameraState::kDead:
      return "dead";
  }
  return "?";
}

}  // namespace phantom::messages
