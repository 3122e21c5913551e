#pragma once

#include <functional>
#include <memory>
#include <string>

#include "components/audio_percept/engine.hpp"

namespace phantom::audio_percept {

/// Closes a lost playback device of a running engine and opens one when it becomes available. One thread, not
/// the audio thread: opening a device takes long.
class DeviceKeeper {
 public:
  /// Opens a device, or returns null and sets `reason`.
  using Opener = std::function<std::unique_ptr<AudioSink>(std::string& reason)>;

  /// `name`: name of the engine's present sink. `retry_s`: time between two attempts, > 0.
  DeviceKeeper(Engine& engine, Opener open, double retry_s, std::string name);

  /// Advances by `dt_s`. Logs changes.
  void step(double dt_s);
  /// Returns the name of the sink in use.
  const std::string& name() const { return name_; }
  int losses() const { return losses_; }

 private:
  Engine& engine_;
  Opener open_;
  double retry_s_, waited_s_ = 0.0;
  std::string name_;
  int losses_ = 0;
};

}  // namespace phantom::audio_percept
