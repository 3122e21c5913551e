#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "components/audio_percept/config.hpp"

namespace phantom::audio_percept {

/// Where sound goes. Every sink asks for periods at the pace at which it uses them up. One thread at a time.
class AudioSink {
 public:
  virtual ~AudioSink() = default;
  /// For the operator, e.g. "live: Built-in Audio".
  virtual std::string name() const = 0;
  /// Periods that are to be written now; `dt_s` is the time since the last call.
  virtual int periods_due(double dt_s) = 0;
  /// The next period: kPeriodFrames of 16 bit, the layout's channels interleaved. Only as many as are due.
  virtual void write(std::span<const std::int16_t> period) = 0;
  /// Sound that is written but not yet taken by the device: what a period written now waits for.
  virtual double queued_s() const = 0;
  /// What the device itself adds until the sound is in the air, as far as it knows.
  virtual double device_latency_s() const = 0;
  /// How often its sound was interrupted, because a period came too late.
  virtual std::uint64_t interruptions() const = 0;
  /// False once the device is gone; from then on the sink must not be used.
  virtual bool alive() const = 0;
};

/// Keeps the pace of the clock and drops the sound (the recording takes it before).
class PacedSink final : public AudioSink {
 public:
  std::string name() const override { return "paced, without a device"; }
  int periods_due(double dt_s) override;
  void write(std::span<const std::int16_t>) override {}
  double queued_s() const override { return 0.0; }
  double device_latency_s() const override { return 0.0; }
  std::uint64_t interruptions() const override { return 0; }
  bool alive() const override { return true; }

 private:
  double owed_s_ = 0.0;
};

/// Opens the configured playback device through OpenAL, whatever `sink` says; null if there is none, with the
/// reason in `reason`.
std::unique_ptr<AudioSink> open_live_sink(const AudioPerceptConfig& config, std::string& reason);

struct OpenedSink {
  std::unique_ptr<AudioSink> sink;  ///< null: paced
  std::string notice;               ///< why it is not a live one; empty if it is, or if none was wanted
  std::string name() const { return sink != nullptr ? sink->name() : PacedSink().name(); }
};

/// The sink that the configuration asks for. Throws runtime::MissingError if it must be live and no device
/// opens.
OpenedSink open_sink(const AudioPerceptConfig& config);

}  // namespace phantom::audio_percept
