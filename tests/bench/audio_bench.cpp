#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "components/audio_percept/engine.hpp"
#include "tests/bench/repetitions.hpp"

namespace {

using namespace phantom;
using namespace phantom::audio_percept;

AudioPerceptConfig shipped(Layout layout) {
  AudioPerceptConfig config = load_config(PHANTOM_SOURCE_DIR "/components/audio_percept/audio_percept.yaml");
  config.layout = layout;
  return config;
}

// A second of the percept's tone, closeness and speed changing with every period.
void synthesize(benchmark::State& state) {
  percept::ToneSynthesizer synthesizer;
  std::array<float, kPeriodFrames> percept{}, alarm{};
  for (auto _ : state) {
    for (int i = 0; i < 200; ++i) {
      synthesizer.set_tone(percept::tone_of({}, 0.005 * i, 0.001 * i));
      synthesizer.render(percept, alarm);
      benchmark::DoNotOptimize(percept);
      benchmark::DoNotOptimize(alarm);
    }
  }
}
BENCHMARK(synthesize)->Name("synthesize/1s");

// A second of all that the audio thread does: percept, alarms, direction, 16-bit frames.
void render(benchmark::State& state, Layout layout) {
  Inbox inbox;
  Engine engine(shipped(layout), nullptr, inbox, nullptr);
  core::Nanoseconds now_ns = core::kNsPerSecond;
  for (auto _ : state) {
    for (int i = 0; i < 200; ++i) {
      now_ns += core::from_seconds(kPeriod_s);
      inbox.percept.write({{.stamp = {1, now_ns, 1},
                            .valid = true,
                            .closeness = 0.005 * i,
                            .speed_m_s = 0.1,
                            .position_m = {0.01 * i, 1, 1}},
                           now_ns});
      engine.turn(kPeriod_s, now_ns);
    }
  }
}
BENCHMARK_CAPTURE(render, stereo, Layout::kStereo)->Name("render/stereo/1s");
BENCHMARK_CAPTURE(render, surround, Layout::k7_1)->Name("render/7.1/1s");
BENCHMARK_CAPTURE(render, hrtf, Layout::kHrtf)->Name("render/hrtf/1s");

// A sound server's device where one runs, else OpenAL's own paced one: chosen before OpenAL is first used.
[[maybe_unused]] const int drivers_chosen = setenv("ALSOFT_DRIVERS", "pulse,null", 0);

// The running audio thread on a device of 240-frame periods: percepts come at 100 Hz for two seconds.
void percept_to_sound(benchmark::State& state) {
  EngineFigures figures;
  for (auto _ : state) {
    const AudioPerceptConfig config = shipped(Layout::kStereo);
    std::string reason;
    auto device = open_live_sink(config, reason);
    if (device == nullptr) {
      state.SkipWithError(reason.c_str());
      return;
    }
    Inbox inbox;
    Engine engine(config, std::move(device), inbox, nullptr);
    engine.start();
    auto next = std::chrono::steady_clock::now();
    for (int i = 0; i < 200; ++i) {
      const core::Nanoseconds now_ns = core::monotonic_ns();
      inbox.percept.write(
          {{.stamp = {1, now_ns, 1}, .valid = true, .closeness = 0.5, .speed_m_s = 0.1}, now_ns});
      std::this_thread::sleep_until(next += std::chrono::milliseconds(10));
    }
    engine.stop();
    figures = engine.figures();
  }
  state.counters["p50_ms"] = figures.latency_p50_ms;
  state.counters["p99_ms"] = figures.latency_p99_ms;
  state.counters["device_ms"] = figures.device_latency_ms;
  state.counters["interruptions"] = static_cast<double>(figures.interruptions);
}
BENCHMARK(percept_to_sound)->Iterations(1)->Repetitions(bench::repetitions(3))->UseRealTime();

}  // namespace
