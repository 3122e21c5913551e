#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "components/audio_percept/config.hpp"

namespace phantom::audio_percept {

/// A destination for sound. Every sink asks for periods at the rate at which it consumes them. One thread at
/// a time.
class AudioSink {
 public:
  virtual ~AudioSink() = default;
  /// Returns the name shown to the operator, e.g. "live: Built-in Audio".
  virtual std::string name() const = 0;
  /// Returns the number of periods to write now; `dt_s` is the time since the last call.
  virtual int periods_due(double dt_s) = 0;
  /// Writes the next period: kPeriodFrames of 16 bit, the layout's channels interleaved. Write only as many
  /// periods as are due.
  virtual void write(std::span<const std::int16_t> period) = 0;
  /// Returns the duration of sound that is written but not yet taken by the device: the delay of a period
  /// written now.
  virtual double queued_s() const = 0;
  /// Returns the delay that the device itself adds until the sound is emitted, as far as it reports one.
  virtual double device_latency_s() const = 0;
  /// Returns how often the sound was interrupted because a period came too late.
  virtual std::uint64_t interruptions() const = 0;
  /// Returns false once the device is gone; from then on the sink must not be used.
  virtual bool alive() const = 0;
};

/// Consumes periods in real time and discards them (the recording receives them separately).
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

/// Opens the configured playback device through OpenAL, whatever `sink` says. Returns null and sets `reason`
/// if there is none.
std::unique_ptr<AudioSink> open_live_sink(const AudioPerceptConfig& config, std::string& reason);

struct OpenedSink {
  std::unique_ptr<AudioSink> sink;  ///< null: a PacedSink is used
  std::string notice;  ///< why the sink is not a live one; empty if it is live or none was requested
  std::string name() const { return sink != nullptr ? sink->name() : PacedSink().name(); }
};

/// Opens the sink that the configuration asks for. Throws runtime::MissingError if it must be live and no
/// device opens.
OpenedSink open_sink(const AudioPerceptConfig& config);

}  // namespace phantom::audio_percept
