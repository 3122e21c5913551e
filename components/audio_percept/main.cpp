#include <iostream>
#include <optional>

#include "common/dds/participant.hpp"
#include "common/runtime/deployment.hpp"
#include "components/audio_percept/render.hpp"
#include "components/audio_percept/session.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  audio_percept::RenderRequest request;
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
    audio_percept::add_options(render, request);
  };
  description.parameters = {audio_percept::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto config = audio_percept::load_config(options.config);
    if (render.given()) return audio_percept::run_render(request, config);
    const auto deployment = runtime::load_deployment(options);
    std::optional<runtime::EndsAtOnce> starting(
        std::in_place);  // a sound server that does not answer can block
    dds::check_qos_profiles(deployment.network.qos_profiles);
    auto sink = audio_percept::open_sink(config);
    if (options.check) {
      std::cout << "configuration is valid; sound would go to: " << sink.name()
                << (sink.notice.empty() ? "" : " (" + sink.notice + ")") << '\n';
      return static_cast<int>(runtime::kExitDone);
    }
    starting.reset();
    audio_percept::run_session(config, deployment.network, std::move(sink), options.report_dir);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
