#pragma once

#include <functional>
#include <memory>
#include <string>

#include "components/audio_percept/engine.hpp"

namespace phantom::audio_percept {

/// Closes a device that went away and opens one when it can be had, for a running engine. One thread, not the
/// audio thread: opening takes long.
class DeviceKeeper {
 public:
  /// Opens a device, or returns null and says why.
  using Opener = std::function<std::unique_ptr<AudioSink>(std::string& reason)>;

  /// `name`: of the sink that the engine has now. `retry_s`: between two attempts, > 0.
  DeviceKeeper(Engine& engine, Opener open, double retry_s, std::string name);

  /// `dt_s` later. Tells in the log what changes.
  void step(double dt_s);
  /// Where the sound goes now.
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
