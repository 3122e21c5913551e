#include "components/audio_percept/session.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/runtime/process.hpp"
#include "components/audio_percept/dds_adapter.hpp"

namespace phantom::audio_percept {
namespace {

constexpr double kDrainPeriod_s = 0.1;
constexpr int kDrainsPerStatus = 5;
constexpr std::size_t kRingSamples = 10 * 48000;  // 10 s: more than a disk stalls

/// The file side of the recording; without a folder it does nothing.
class Recorder {
 public:
  explicit Recorder(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::filesystem::create_directories(folder);
    ring_.emplace(kRingSamples);
    file_.emplace(folder / "audio.wav");
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
  std::array<std::int16_t, 4800> chunk_{};
  std::uint64_t reported_drop_ = 0;
};

void write_report(const std::filesystem::path& folder, const WavFile& wav, const EngineFigures& figures,
                  const std::string& sink_name) {
  const nlohmann::ordered_json report{{"wav", "audio.wav"},
                                      {"seconds", wav.seconds()},
                                      {"sink", sink_name},
                                      {"latency_ms",
                                       {{"p50", figures.latency_p50_ms},
                                        {"p99", figures.latency_p99_ms},
                                        {"max", figures.latency_max_ms},
                                        {"n", figures.percepts}}},
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
  if (figures.alarm == percept::Alarm::kStopped) {
    health.message = figures.drive_fault ? "stopped: drives in fault" : "emergency stop";
  } else if (figures.alarm == percept::Alarm::kLinkLost && health.state != core::ComponentState::kDegraded) {
    health.state = core::ComponentState::kDegraded;
    health.message = "the link between master and slave is lost or degraded";
  } else if (figures.sink_lost && health.state == core::ComponentState::kRunning) {
    health.state = core::ComponentState::kDegraded;
    health.message = "the playback device went away: no sound";
  }
  health.loops = {loop};
  health.figures = {{"frequency", figures.frequency_Hz, "Hz"},
                    {"gain", figures.gain, ""},
                    {"latency_p50", figures.latency_p50_ms, "ms"},
                    {"latency_p99", figures.latency_p99_ms, "ms"},
                    {"percepts", static_cast<double>(figures.percepts), ""}};
  return health;
}

void run_session(const AudioPerceptConfig& config, const core::NetworkOptions& network, OpenedSink sink,
                 const std::filesystem::path& report_dir) {
  Recorder recorder(report_dir);
  Inbox inbox;
  const std::string sink_name = sink.sink->name();
  spdlog::info("sound goes to: {}{}", sink_name, recorder.file() ? " and audio.wav" : "");
  if (!sink.notice.empty()) spdlog::warn("{}: the sound is made but not heard here", sink.notice);
  Engine engine(config, std::move(sink.sink), sink.live, inbox, recorder.ring());
  DdsAdapter adapter(network, inbox);
  engine.start();
  std::string last_message;
  for (int i = 0; runtime::sleep_unless_stopped(kDrainPeriod_s); ++i) {
    recorder.drain();
    if (i % kDrainsPerStatus != 0) continue;
    const core::Health health = health_of(engine.figures(), engine.loop_statistics(), sink_name);
    log_changes(health, last_message);
    adapter.report(health);
  }
  engine.stop();
  recorder.drain();
  core::Health last = health_of(engine.figures(), engine.loop_statistics(), sink_name);
  last.state = core::ComponentState::kStopped;
  last.message = "ended in order";
  adapter.report(last);
  if (recorder.file()) write_report(report_dir, *recorder.file(), engine.figures(), sink_name);
}

}  // namespace phantom::audio_percept
