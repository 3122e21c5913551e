#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "components/audio_percept/audio_percept.hpp"
#include "components/audio_percept/sink.hpp"

namespace phantom::audio_percept {

/// A device that plays at the pace of the dt it is told, keeps what it was given, and can be unplugged. The
/// state is the test's, so that it outlives the sink.
struct FakeDevice {
  std::vector<std::int16_t> heard;
  bool plugged = true;
  int queue = 3;  // periods
  double latency_s = 0.002;
  int open = 0;  // sinks that are alive
};

class FakeSink final : public AudioSink {
 public:
  explicit FakeSink(FakeDevice& device) : device_(device) { ++device_.open; }
  ~FakeSink() override { --device_.open; }
  std::string name() const override { return "live: fake"; }
  int periods_due(double dt_s) override {
    since_progress_s_ += dt_s;
    if (queued_ > 0) playing_s_ += dt_s;
    while (queued_ > 0 && playing_s_ >= kPeriod_s - 1e-9) {
      playing_s_ -= kPeriod_s;
      --queued_;
      since_progress_s_ = 0.0;
    }
    if (queued_ == 0) {
      playing_s_ = 0.0;
      interruptions_ += started_;
      started_ = false;
    }
    return device_.queue - queued_;
  }
  void write(std::span<const std::int16_t> period) override {
    device_.heard.insert(device_.heard.end(), period.begin(), period.end());
    ++queued_;
    started_ = started_ || queued_ == device_.queue;
  }
  double queued_s() const override { return queued_ * kPeriod_s; }
  double device_latency_s() const override { return device_.latency_s; }
  std::uint64_t interruptions() const override { return interruptions_; }
  bool alive() const override { return device_.plugged && since_progress_s_ <= 2.0; }

 private:
  FakeDevice& device_;
  int queued_ = 0;
  bool started_ = false;
  std::uint64_t interruptions_ = 0;
  double playing_s_ = 0.0, since_progress_s_ = 0.0;
};

}  // namespace phantom::audio_percept
