#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <thread>

#include "common/core/histogram.hpp"
#include "common/core/snapshot.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "components/audio_percept/inbox.hpp"
#include "components/audio_percept/recording.hpp"
#include "components/audio_percept/sink.hpp"
#include "components/audio_percept/spatialiser.hpp"

namespace phantom::audio_percept {

/// Figures that the audio thread publishes about itself.
struct EngineFigures {
  Situation situation = Situation::kWaiting;
  percept::Alarm alarm = percept::Alarm::kNone;  ///< the most serious alarm present
  double frequency_Hz = 0.0;                     ///< of the requested tone
  double gain = 0.0;
  double azimuth_deg = 0.0, elevation_deg = 0.0;  ///< direction of the tone, relative to the listener
  double latency_p50_ms = 0.0;                    ///< from a percept's stamp until its sound is emitted
  double latency_p99_ms = 0.0;
  double latency_max_ms = 0.0;
  double device_latency_ms = 0.0;   ///< the part that the device reports as its own
  std::uint64_t percepts = 0;       ///< number of percepts made audible
  std::uint64_t interruptions = 0;  ///< interruptions of the device in use because a period came too late
  std::uint64_t alarm_bursts = 0;   ///< number of alarm bursts started
  bool live = false;                ///< a playback device is in use
  bool device_lost = false;         ///< a device was in use and is gone; the sound goes on without one
};

/// Returns the component's health (state, one sentence, figures) from the audio thread's figures.
core::Health health_of(const EngineFigures& figures, const core::LoopStatistics& loop,
                       const std::string& sink_name);

/// The audio thread: asks the sink how many periods it needs, renders them from the newest samples, and
/// writes them to the sink.
class Engine {
 public:
  /// `device` and `recording` may be null. All arguments must outlive the engine, which owns the device.
  /// Throws runtime::MissingError if the layout cannot be rendered.
  Engine(const AudioPerceptConfig& config, std::unique_ptr<AudioSink> device, Inbox& inbox,
         SampleRing* recording);
  ~Engine();

  void start();
  void stop();  ///< ends the thread; a second call does nothing

  // Devices can come and go while the thread runs. Another thread opens and closes them, because that takes
  // long.

  /// Returns whether there is no device, nor one handed over. Any thread.
  bool wants_device() const noexcept;
  /// Hands over a device, which the audio thread uses from its next turn on. Call it only while
  /// wants_device(). One thread.
  void offer(std::unique_ptr<AudioSink> device);
  /// Returns the lost device, to be closed, or null if there is none. One thread.
  std::unique_ptr<AudioSink> take_back() noexcept;

  /// Return the newest figures and the loop statistics. One reader thread.
  EngineFigures figures();
  core::LoopStatistics loop_statistics() { return loop_.statistics(); }
  /// Returns which permission the audio thread was refused (real-time priority); empty if none. Any thread.
  std::string notice() const { return loop_.notice(); }

  /// Performs one turn of the thread, `dt_s` after the previous one and at time `now_ns`. For the thread and
  /// for tests.
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
  std::array<float, kPeriodFrames * kMaxChannels> frames_{};
  std::array<std::int16_t, kPeriodFrames * kMaxChannels> samples_{};
  core::Snapshot<EngineFigures> published_;
  EngineFigures latest_;
  runtime::PeriodicLoop loop_;
  std::thread thread_;
};

}  // namespace phantom::audio_percept
