#include "components/audio_percept/engine.hpp"

#include <cmath>

#include "common/core/units.hpp"

namespace phantom::audio_percept {
namespace {

// The device is polled four times a period. Backends that poll a clock sometimes take two updates in half the
// usual time, and the queue must be refilled between them.
constexpr double kTurnPeriod_s = 0.25 * kPeriod_s;

}  // namespace

Engine::Engine(const AudioPerceptConfig& config, std::unique_ptr<AudioSink> device, Inbox& inbox,
               SampleRing* recording)
    : percept_(config),
      spatialiser_(config.layout, config.listener.near_m),
      period_samples_(kPeriodFrames * channel_count(config.layout)),
      device_(std::move(device)),
      has_device_(device_ != nullptr),
      inbox_(inbox),
      recording_(recording),
      loop_("audio", kTurnPeriod_s, core::ThreadRole::kAudio, {.servo_priority = config.servo_priority}) {}

Engine::~Engine() {
  stop();
  delete offered_.load();
  delete returned_.load();
}

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

bool Engine::wants_device() const noexcept { return !has_device_.load() && offered_.load() == nullptr; }

void Engine::offer(std::unique_ptr<AudioSink> device) {
  has_device_ = true;
  delete offered_.exchange(device.release());
}

std::unique_ptr<AudioSink> Engine::take_back() noexcept {
  return std::unique_ptr<AudioSink>(returned_.exchange(nullptr));
}

AudioSink& Engine::sink() noexcept {
  if (device_ == nullptr) {
    device_.reset(offered_.exchange(nullptr));
    if (device_ != nullptr) lost_ = false;
  } else if (!device_->alive()) {
    lost_ = true;
    if (returned_.load() != nullptr) return paced_;  // the previous lost device was not fetched yet
    returned_ = device_.release();
    has_device_ = false;
  }
  return device_ != nullptr ? *device_ : paced_;
}

void Engine::turn(double dt_s, core::Nanoseconds now_ns) {
  AudioSink& used = sink();
  const int periods = used.periods_due(dt_s);
  if (periods > 0) {
    inbox_.collect(inputs_);
    inputs_.now_ns = now_ns;
    note_latency(used, now_ns);
  }
  for (int i = 0; i < periods; ++i) {
    render_period();
    const std::span period(samples_.data(), period_samples_);
    used.write(period);
    if (recording_ != nullptr) recording_->push(period);
  }
  constexpr int kTurnsPerReport = 50;
  if (++turns_ % kTurnsPerReport == 0) publish();
}

void Engine::render_period() {
  percept_.step(inputs_, tone_, alarm_);
  spatialiser_.render(tone_, alarm_, percept_.source_position(), std::span(frames_.data(), period_samples_));
  for (std::size_t i = 0; i < period_samples_; ++i) {
    samples_[i] = static_cast<std::int16_t>(std::lround(32767.0F * frames_[i]));
  }
}

void Engine::note_latency(const AudioSink& used, core::Nanoseconds now_ns) {
  const auto& sample = inputs_.percept;
  if (!sample.valid || sample.received_ns == last_percept_ns_) return;
  last_percept_ns_ = sample.received_ns;
  device_latency_s_ = used.device_latency_s();
  const double ahead_s = used.queued_s() + spatialiser_.delay_s() + device_latency_s_;
  latency_.record(now_ns - sent_ns(sample) + core::from_seconds(ahead_s));
}

void Engine::publish() noexcept {
  const auto ms = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-6; };
  published_.write({.situation = percept_.situation(),
                    .alarm = percept_.alarm(),
                    .frequency_Hz = percept_.tone().frequency_Hz,
                    .gain = percept_.tone().gain,
                    .azimuth_deg = azimuth_rad(percept_.source_position()) / core::kRadPerDegree,
                    .elevation_deg = elevation_rad(percept_.source_position()) / core::kRadPerDegree,
                    .latency_p50_ms = ms(latency_.quantile_ns(0.5)),
                    .latency_p99_ms = ms(latency_.quantile_ns(0.99)),
                    .latency_max_ms = ms(latency_.max_ns()),
                    .device_latency_ms = 1e3 * device_latency_s_,
                    .percepts = latency_.count(),
                    .interruptions = device_ != nullptr ? device_->interruptions() : 0,
                    .alarm_bursts = percept_.bursts(),
                    .live = device_ != nullptr && !lost_,
                    .device_lost = lost_});
}

EngineFigures Engine::figures() {
  published_.read(latest_);
  return latest_;
}

core::Health health_of(const EngineFigures& figures, const core::LoopStatistics& loop,
                       const std::string& sink_name) {
  using enum core::ComponentState;
  using percept::Alarm;
  core::Health health;
  const auto set = [&health](core::ComponentState state, std::string message) {
    health.state = state;
    health.message = std::move(message);
  };
  const bool stale = figures.situation == Situation::kStale;
  const char* const stale_text = "the percept is stale: silence and alarm";
  set(kRunning, "sounding, " + sink_name);
  if (figures.situation == Situation::kOff) set(kRunning, "the operator works without the tone: alarms only");
  if (figures.situation == Situation::kWaiting) set(kReady, "waiting for the percept");
  if (stale) set(kDegraded, stale_text);
  if (figures.device_lost) set(kDegraded, "the playback device went away: no sound");
  if (figures.alarm == Alarm::kEmergencyStop) health.message = "emergency stop";
  if (figures.alarm == Alarm::kDriveFault) health.message = "stopped: drives in fault";
  if (figures.alarm == Alarm::kLinkLost)
    set(kDegraded, stale ? stale_text : "the link between master and slave is lost or degraded");
  if (figures.alarm == Alarm::kWorkspaceStale)
    set(kDegraded, "the percept's model cannot be relied on: silence and alarm");
  // phantom_sensing reports the other alarms.
  health.loops = {loop};
  health.figures = {{"frequency", figures.frequency_Hz, "Hz"},
                    {"gain", figures.gain, ""},
                    {"azimuth", figures.azimuth_deg, "deg"},
                    {"elevation", figures.elevation_deg, "deg"},
                    {"latency_p50", figures.latency_p50_ms, "ms"},
                    {"latency_p99", figures.latency_p99_ms, "ms"},
                    {"device_latency", figures.device_latency_ms, "ms"},
                    {"percepts", static_cast<double>(figures.percepts), ""},
                    {"interruptions", static_cast<double>(figures.interruptions), ""},
                    {"alarm_bursts", static_cast<double>(figures.alarm_bursts), ""}};
  return health;
}

}  // namespace phantom::audio_percept
