#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "components/audio_percept/dds_adapter.hpp"
#include "components/audio_percept/device_keeper.hpp"
#include "components/audio_percept/render.hpp"
#include "components/audio_percept/spatialiser.hpp"

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
  const bool degraded = now.state == core::ComponentState::kDegraded;
  spdlog::log(degraded ? spdlog::level::warn : spdlog::level::info, "{}", now.message);
}

/// Runs the component until a stop is requested. Writes audio.wav and audio_percept.json to the report
/// folder, if one is given. Throws dds::DdsError, std::runtime_error.
void run_session(const AudioPerceptConfig& config, const core::NetworkOptions& network, OpenedSink sink,
                 const std::filesystem::path& report_dir) {
  Recorder recorder(report_dir, config.layout);
  Inbox inbox;
  const std::string first_name = sink.name();
  spdlog::info("sound, {}, goes to: {}{}", name_of(config.layout), first_name,
               recorder.file() ? " and audio.wav" : "");
  if (!sink.notice.empty()) {
    spdlog::warn("{}: sound is rendered but not played; looking for a device every {:.3g} s", sink.notice,
                 config.retry_s);
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

}  // namespace
}  // namespace phantom::audio_percept

int main(int argc, char** argv) {
  using namespace phantom;
  using namespace phantom::audio_percept;
  RenderRequest request;
  runtime::Command render;
  runtime::ProcessDescription description;
  description.name = "audio_percept";
  description.summary =
      "Makes the vicinity of objects audible: pitch tells how close the nearest part of the arm is, "
      "loudness how fast it moves, and direction where. "
      "Alarms tell a lost link, an emergency stop and unsafe motion apart from it.";
  description.details =
      "Topics in: percept, master_state, slave_state, hit_alert, operator_command. Topic out: "
      "component_status.\n"
      "Without a playback device the sound is made all the same; --report-dir keeps it as audio.wav.\n"
      "Example: audio_percept --report-dir report\n"
      "Example without DDS: audio_percept render --input approach.csv --out approach.wav --spectrogram "
      "approach.png";
  description.add_options = [&](runtime::Command app) {
    render = app.subcommand("render", "make the sound of a CSV file or a recording, without DDS");
    add_options(render, request);
  };
  description.parameters = {kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto config = load_config(options.config);
    if (render.given()) return run_render(request, config);
    const auto deployment = runtime::load_deployment(options);
    std::optional<runtime::EndsAtOnce> starting(
        std::in_place);  // a sound server that does not answer can block
    dds::check_qos_profiles(deployment.network.qos_profiles);
    auto sink = open_sink(config);
    if (options.check) {
      const Spatialiser renders(config.layout, config.listener.near_m);
      return runtime::configuration_is_valid("; sound would go to: " + std::string(sink.name()) +
                                             (sink.notice.empty() ? "" : " (" + sink.notice + ")"));
    }
    starting.reset();
    run_session(config, deployment.network, std::move(sink), options.report_dir);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
