#include "components/audio_percept/engine.hpp"

#include <cmath>

namespace phantom::audio_percept {
namespace {

// A device is asked twice a period, so that its queue is refilled half a period after it moved on.
double turn_period_s(bool live) { return live ? 0.5 * kPeriod_s : kPeriod_s; }

}  // namespace

Engine::Engine(const AudioPerceptConfig& config, std::unique_ptr<AudioSink> sink, bool live, Inbox& inbox,
               SampleRing* recording)
    : percept_(config),
      sink_(std::move(sink)),
      used_(sink_.get()),
      inbox_(inbox),
      recording_(recording),
      loop_("audio", turn_period_s(live)) {}

Engine::~Engine() { stop(); }

void Engine::start() {
  thread_ = std::thread([this] {
    loop_.run([this](double dt_s) {
      turn(dt_s, core::monotonic_ns());
      return true;
    });
  });
}

void Engine::stop() {
  loop_.stop();
  if (thread_.joinable()) thread_.join();
}

void Engine::turn(double dt_s, core::Nanoseconds now_ns) {
  if (!used_->alive()) used_ = &spare_;
  const int periods = used_->periods_due(dt_s);
  if (periods > 0) {
    inbox_.collect(inputs_);
    inputs_.now_ns = now_ns;
    note_latency(now_ns);
  }
  for (int i = 0; i < periods; ++i) {
    percept_.step(inputs_, mono_);
    for (std::size_t k = 0; k < kPeriodFrames; ++k) {
      samples_[k] = static_cast<std::int16_t>(std::lround(32767.0F * mono_[k]));
    }
    used_->write(samples_);
    if (recording_ != nullptr) recording_->push(samples_);
  }
  constexpr int kTurnsPerReport = 50;
  if (++turns_ % kTurnsPerReport == 0) publish();
}

void Engine::note_latency(core::Nanoseconds now_ns) {
  const PerceptSample& sample = inputs_.percept;
  if (!sample.valid || sample.received_ns == last_percept_ns_) return;
  last_percept_ns_ = sample.received_ns;
  latency_.record(now_ns - sample.received_ns + core::from_seconds(used_->queued_s()));
}

void Engine::publish() noexcept {
  const auto ms = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-6; };
  published_.write({percept_.situation(), percept_.alarm(), percept_.drive_fault(), percept_.tone().frequency_Hz,
                    percept_.tone().gain, ms(latency_.quantile_ns(0.5)), ms(latency_.quantile_ns(0.99)),
                    ms(latency_.max_ns()), latency_.count(), used_ == &spare_});
}

EngineFigures Engine::figures() {
  published_.read(latest_);
  return latest_;
}

}  // namespace phantom::audio_percept
