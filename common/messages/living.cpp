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

std::string live_name(std::uint16_t id) {
  return id == kLiveId ? kLiveName : "live object " + std::to_string(id - kFirstLiveObjectId + 1);
}

bool is_live_name(const std::string& name) {
  for (std::uint16_t id = kFirstLiveObjectId; id <= kLiveId; ++id)
    if (name == live_name(id)) return true;
  return false;
}

}  // namespace phantom::messages
