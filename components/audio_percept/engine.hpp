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

namespace phantom::audio_percept {

/// What the audio thread says about itself.
struct EngineFigures {
  Situation situation = Situation::kWaiting;
  percept::Alarm alarm = percept::Alarm::kNone;
  bool drive_fault = false;   ///< why an end is stopped; false: an emergency stop
  double frequency_Hz = 0.0;  ///< of the tone that is asked for
  double gain = 0.0;
  double latency_p50_ms = 0.0;  ///< from a percept's arrival here until its sound leaves our queue
  double latency_p99_ms = 0.0;
  double latency_max_ms = 0.0;
  std::uint64_t percepts = 0;  ///< that were made audible
  bool sink_lost = false;      ///< the live device went away; the sound goes on without one
};

/// The audio thread: asks the sink how much it wants, renders from the newest samples, hands it on.
class Engine {
 public:
  /// `recording` may be null. All that is handed in must outlive the engine; the sink becomes its own.
  Engine(const AudioPerceptConfig& config, std::unique_ptr<AudioSink> sink, bool live, Inbox& inbox,
         SampleRing* recording);
  ~Engine();

  void start();
  void stop();  ///< ends the thread; a second call does nothing

  /// Newest figures and loop statistics. One reader thread.
  EngineFigures figures();
  core::LoopStatistics loop_statistics() { return loop_.statistics(); }

  /// One turn of the thread: `dt_s` since the last one, now at `now_ns`. For the thread and for tests.
  void turn(double dt_s, core::Nanoseconds now_ns);

 private:
  void note_latency(core::Nanoseconds now_ns);
  void publish() noexcept;

  AudioPercept percept_;
  std::unique_ptr<AudioSink> sink_;
  PacedSink spare_;
  AudioSink* used_;
  Inbox& inbox_;
  SampleRing* recording_;
  Inputs inputs_;
  core::DurationHistogram latency_;
  core::Nanoseconds last_percept_ns_ = 0;
  int turns_ = 0;
  std::array<float, kPeriodFrames> mono_{};
  std::array<std::int16_t, kPeriodFrames> samples_{};
  core::Snapshot<EngineFigures> published_;
  EngineFigures latest_;
  runtime::PeriodicLoop loop_;
  std::thread thread_;
};

}  // namespace phantom::audio_percept
