#include "components/audio_percept/device_keeper.hpp"

#include <spdlog/spdlog.h>

namespace phantom::audio_percept {

DeviceKeeper::DeviceKeeper(Engine& engine, Opener open, double retry_s, std::string name)
    : engine_(engine), open_(std::move(open)), retry_s_(retry_s), name_(std::move(name)) {}

void DeviceKeeper::step(double dt_s) {
  if (const auto gone = engine_.take_back()) {
    spdlog::warn("{} removed: sound continues without it; looking for a device every {:.3g} s", gone->name(),
                 retry_s_);
    name_ = PacedSink().name();
    waited_s_ = 0.0;
    ++losses_;
  }
  if (!engine_.wants_device()) return;
  waited_s_ += dt_s;
  if (waited_s_ < retry_s_) return;
  waited_s_ = 0.0;
  std::string reason;
  auto device = open_(reason);
  if (device == nullptr) return;  // the reason was logged at the start or when the last device was lost
  name_ = device->name();
  spdlog::info("sound goes to: {}", name_);
  engine_.offer(std::move(device));
}

}  // namespace phantom::audio_percept
