#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <thread>

#include "common/core/histogram.hpp"
#include "common/core/snapshot.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "components/audio_percept/inbox.hpp"
#include "components/audio_percept/recording.hpp"
#include "components/audio_percept/sink.hpp"
#include "components/audio_percept/spatialiser.hpp"

namespace phantom::audio_percept {

/// What the audio thread says about itself.
struct EngineFigures {
  Situation situation = Situation::kWaiting;
  percept::Alarm alarm = percept::Alarm::kNone;  ///< the gravest that stands
  double frequency_Hz = 0.0;                     ///< of the tone that is asked for
  double gain = 0.0;
  double azimuth_deg = 0.0, elevation_deg = 0.0;  ///< where it is heard, against the ears
  double latency_p50_ms = 0.0;                    ///< from a percept's stamp until its sound is in the air
  double latency_p99_ms = 0.0;
  double latency_max_ms = 0.0;
  double device_latency_ms = 0.0;   ///< the device's own share of it, as it tells
  std::uint64_t percepts = 0;       ///< that were made audible
  std::uint64_t interruptions = 0;  ///< of the device in use, by periods that came too late
  std::uint64_t alarm_bursts = 0;   ///< that were begun
  bool live = false;                ///< a playback device is in use
  bool device_lost = false;         ///< one was, and is gone; the sound goes on without
};

/// The audio thread: asks the sink how much it wants, renders from the newest samples, hands it on.
class Engine {
 public:
  /// `device` and `recording` may be null. All that is handed in must outlive the engine; the device becomes
  /// its own. Throws runtime::MissingError if the layout cannot be rendered.
  Engine(const AudioPerceptConfig& config, std::unique_ptr<AudioSink> device, Inbox& inbox,
         SampleRing* recording);
  ~Engine();

  void start();
  void stop();  ///< ends the thread; a second call does nothing

  // Devices come and go while the thread runs; they are opened and closed by another one, as that takes long.

  /// Whether there is no device, nor one on its way. Any thread.
  bool wants_device() const noexcept;
  /// Hands over a device that the audio thread uses from its next turn on. Only while one is wanted; one
  /// thread.
  void offer(std::unique_ptr<AudioSink> device);
  /// The device that went away, to be closed; null if none did. One thread.
  std::unique_ptr<AudioSink> take_back() noexcept;

  /// Newest figures and loop statistics. One reader thread.
  EngineFigures figures();
  core::LoopStatistics loop_statistics() { return loop_.statistics(); }
  /// What the audio thread was refused (real-time priority); empty if nothing. Any thread.
  std::string notice() const { return loop_.notice(); }

  /// One turn of the thread: `dt_s` since the last one, now at `now_ns`. For the thread and for tests.
  void turn(double dt_s, core::Nanoseconds now_ns);

 private:
  AudioSink& sink() noexcept;
  void render_period();
  void note_latency(const AudioSink& sink, core::Nanoseconds now_ns);
  void publish() noexcept;

  AudioPercept percept_;
  Spatialiser spatialiser_;
  std::size_t period_samples_;
  std::unique_ptr<AudioSink> device_;
  PacedSink paced_;
  std::atomic<AudioSink*> offered_{nullptr}, returned_{nullptr};
  std::atomic<bool> has_device_{false};
  bool lost_ = false;
  Inbox& inbox_;
  SampleRing* recording_;
  Inputs inputs_;
  core::DurationHistogram latency_;
  double device_latency_s_ = 0.0;
  core::Nanoseconds last_percept_ns_ = 0;
  int turns_ = 0;
  std::array<float, kPeriodFrames> tone_{}, alarm_{};
  std::array<float, kPeriodFrames * kMostChannels> frames_{};
  std::array<std::int16_t, kPeriodFrames * kMostChannels> samples_{};
  core::Snapshot<EngineFigures> published_;
  EngineFigures latest_;
  runtime::PeriodicLoop loop_;
  std::thread thread_;
};

}  // namespace phantom::audio_percept
