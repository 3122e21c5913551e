#include "components/audio_percept/session.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/runtime/process.hpp"
#include "components/audio_percept/dds_adapter.hpp"
#include "components/audio_percept/device_keeper.hpp"

namespace phantom::audio_percept {
namespace {

constexpr double kDrainPeriod_s = 0.1;
constexpr int kDrainsPerStatus = 5;
constexpr std::size_t kRingFrames = 10 * 48000;  // 10 s: longer than a disk stalls

/// Writes the recording to its file; does nothing without a folder.
class Recorder {
 public:
  Recorder(const std::filesystem::path& folder, Layout layout) {
    if (folder.empty()) return;
    std::filesystem::create_directories(folder);
    ring_.emplace(kRingFrames * channel_count(layout));
    file_.emplace(folder / "audio.wav", layout);
  }
  SampleRing* ring() { return ring_ ? &*ring_ : nullptr; }
  const std::optional<WavFile>& file() const { return file_; }

  void drain() {
    if (!ring_) return;
    while (const std::size_t count = ring_->pop(chunk_)) file_->write({chunk_.data(), count});
    if (ring_->dropped() > reported_drop_) {
      reported_drop_ = ring_->dropped();
      spdlog::warn("the recording lacks {} samples so far: the disk was too slow", reported_drop_);
    }
  }

 private:
  std::optional<SampleRing> ring_;
  std::optional<WavFile> file_;
  std::array<std::int16_t, 4800> chunk_{};  // a multiple of every layout's frame
  std::uint64_t reported_drop_ = 0;
};

void write_report(const std::filesystem::path& folder, const WavFile& wav, const EngineFigures& figures,
                  const DeviceKeeper& device, Layout layout) {
  const nlohmann::ordered_json report{{"wav", "audio.wav"},
                                      {"seconds", wav.seconds()},
                                      {"channels", name_of(layout)},
                                      {"sink", device.name()},
                                      {"device_losses", device.losses()},
                                      {"latency_ms",
                                       {{"p50", figures.latency_p50_ms},
                                        {"p99", figures.latency_p99_ms},
                                        {"max", figures.latency_max_ms},
                                        {"device", figures.device_latency_ms},
                                        {"n", figures.percepts}}},
                                      {"interruptions", figures.interruptions},
                                      {"alarm_bursts", figures.alarm_bursts},
                                      {"peak", wav.peak()}};
  std::ofstream file(folder / "audio_percept.json");
  file << report.dump(2) << '\n';
  if (!file.flush())
    throw std::runtime_error((folder / "audio_percept.json").string() + " cannot be written");
}

void log_changes(const core::Health& now, std::string& last_message) {
  if (now.message == last_message) return;
  last_message = now.message;
  if (now.state == core::ComponentState::kDegraded) {
    spdlog::warn("{}", now.message);
  } else {
    spdlog::info("{}", now.message);
  }
}

/// Sets the state and the message for an alarm, if there is one.
void report_alarm(percept::Alarm alarm, Situation situation, core::Health& health) {
  using percept::Alarm;
  const bool stale = situation == Situation::kStale;
  switch (alarm) {
    case Alarm::kEmergencyStop:
      health.message = "emergency stop";
      return;
    case Alarm::kDriveFault:
      health.message = "stopped: drives in fault";
      return;
    case Alarm::kLinkLost:
      health.state = core::ComponentState::kDegraded;
      health.message = stale ? "the percept is stale: silence and alarm"
                             : "the link between master and slave is lost or degraded";
      return;
    case Alarm::kWorkspaceStale:
      health.state = core::ComponentState::kDegraded;
      health.message = "the percept's model cannot be relied on: silence and alarm";
      return;
    case Alarm::kUnsafeMotion:
    case Alarm::kWorkspaceAged:
    case Alarm::kMutedContact:
    case Alarm::kNone:
      return;  // phantom_sensing reports it
  }
}

}  // namespace

core::Health health_of(const EngineFigures& figures, const core::LoopStatistics& loop,
                       const std::string& sink_name) {
  core::Health health;
  switch (figures.situation) {
    case Situation::kWaiting:
      health.state = core::ComponentState::kReady;
      health.message = "waiting for the percept";
      break;
    case Situation::kFreeSpace:
    case Situation::kSounding:
      health.state = core::ComponentState::kRunning;
      health.message = "sounding, " + sink_name;
      break;
    case Situation::kStale:
      health.state = core::ComponentState::kDegraded;
      health.message = "the percept is stale: silence and alarm";
      break;
  }
  if (figures.device_lost) {
    health.state = core::ComponentState::kDegraded;
    health.message = "the playback device went away: no sound";
  }
  report_alarm(figures.alarm, figures.situation, health);
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

void run_session(const AudioPerceptConfig& config, const core::NetworkOptions& network, OpenedSink sink,
                 const std::filesystem::path& report_dir) {
  Recorder recorder(report_dir, config.layout);
  Inbox inbox;
  const std::string first_name = sink.name();
  spdlog::info("sound, {}, goes to: {}{}", name_of(config.layout), first_name,
               recorder.file() ? " and audio.wav" : "");
  if (!sink.notice.empty()) {
    spdlog::warn("{}: the sound is made but not heard here; a device is looked for every {:.3g} s",
                 sink.notice, config.retry_s);
  }
  Engine engine(config, std::move(sink.sink), inbox, recorder.ring());
  DeviceKeeper device(
      engine, [&config](std::string& reason) { return open_live_sink(config, reason); }, config.retry_s,
      first_name);
  DdsAdapter adapter(network, inbox);
  engine.start();
  std::string last_message, last_notice;
  for (int i = 0; runtime::sleep_unless_stopped(kDrainPeriod_s); ++i) {
    recorder.drain();
    if (const std::string notice = engine.notice(); notice != last_notice)
      spdlog::info("{}", last_notice = notice);
    if (config.sink != SinkChoice::kPaced) device.step(kDrainPeriod_s);
    if (i % kDrainsPerStatus != 0) continue;
    const core::Health health = health_of(engine.figures(), engine.loop_statistics(), device.name());
    log_changes(health, last_message);
    adapter.report(health);
  }
  engine.stop();
  recorder.drain();
  core::Health last = health_of(engine.figures(), engine.loop_statistics(), device.name());
  last.state = core::ComponentState::kStopped;
  last.message = "ended in order";
  adapter.report(last);
  if (recorder.file()) write_report(report_dir, *recorder.file(), engine.figures(), device, config.layout);
}

}  // namespace phantom::audio_percept
