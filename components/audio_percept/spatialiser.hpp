#pragma once

#include <memory>
#include <span>

#include "components/audio_percept/layout.hpp"
#include "components/audio_percept/listener.hpp"

namespace phantom::audio_percept {

/// Places the percept around the operator and the alarms straight ahead. It uses OpenAL Soft's panning on its
/// loopback device, which renders without hardware and gives the same samples every time. Mono is the sum of
/// percept and alarms. One thread at a time.
class Spatialiser {
 public:
  /// Throws runtime::MissingError if OpenAL cannot render this layout (no HRTF data set installed, …).
  Spatialiser(Layout layout, double near_m);
  ~Spatialiser();

  /// Returns the delay from input to output.
  double delay_s() const noexcept;

  /// Mixes `percept`, heard from `p_listener_m` (in the frame of the listener; its length counts only within
  /// near_m), with `alarm` into `frames`. Both signals have the same length, kPeriodFrames at most. `frames`
  /// has that length times the layout's channels, interleaved, within ±1. Our code allocates nothing; OpenAL
  /// Soft allocates a queue entry of some bytes per call, in all layouts but mono.
  void render(std::span<const float> percept, std::span<const float> alarm, const Vector3& p_listener_m,
              std::span<float> frames) noexcept;

 private:
  struct OpenAl;
  std::unique_ptr<OpenAl> openal_;  // null for mono
};

}  // namespace phantom::audio_percept
