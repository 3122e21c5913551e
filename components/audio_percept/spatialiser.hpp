#pragma once

#include <memory>
#include <span>

#include "components/audio_percept/layout.hpp"
#include "components/audio_percept/listener.hpp"

namespace phantom::audio_percept {

/// Places the percept around the operator and the alarms straight ahead: OpenAL Soft's panning on its
/// loopback device, which renders without hardware, the same samples every time. Mono is their sum. One
/// thread at a time.
class Spatialiser {
 public:
  /// Throws runtime::MissingError if OpenAL cannot render this layout (no HRTF data set installed, …).
  Spatialiser(Layout layout, double near_m);
  ~Spatialiser();

  Layout layout() const noexcept { return layout_; }
  /// By how much sound comes later than it went in.
  double delay_s() const noexcept;

  /// Mixes `percept`, heard from `p_ears_m` (in the ears' frame; its length counts only within near_m), and
  /// `alarm`, two signals of equal length, kPeriodFrames at most, into `frames`: their length times the
  /// layout's channels, interleaved, within ±1. Our side allocates nothing; OpenAL Soft, in all layouts but
  /// mono, a queue entry of some bytes per call.
  void render(std::span<const float> percept, std::span<const float> alarm, const Vector3& p_ears_m,
              std::span<float> frames) noexcept;

 private:
  struct OpenAl;
  Layout layout_;
  std::unique_ptr<OpenAl> openal_;  // none for mono
};

}  // namespace phantom::audio_percept
