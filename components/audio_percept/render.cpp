#include "components/audio_percept/render.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "common/core/errors.hpp"
#include "common/runtime/process/process.hpp"
#include "components/audio_percept/recording.hpp"
#include "components/audio_percept/spatialiser.hpp"
#include "components/audio_percept/spectrogram.hpp"

namespace phantom::audio_percept {
namespace {

constexpr double kTail_s = 0.25, kMax_s = 3600.0;

}  // namespace

std::vector<std::int16_t> render_track(const Track& track, const AudioPerceptConfig& config, double tail_s) {
  const std::size_t channels = channel_count(config.layout);
  AudioPercept percept(config);
  Spatialiser spatialiser(config.layout, config.listener.near_m);
  std::array<float, kPeriodFrames> tone{}, alarm{};
  std::vector<float> frames(kPeriodFrames * channels);
  std::vector<std::int16_t> samples;
  Inputs inputs, next;
  bool more = track(next);
  core::Nanoseconds end_ns = 0;
  for (core::Nanoseconds now_ns = next.now_ns;; now_ns += core::from_seconds(kPeriod_s)) {
    for (; more && next.now_ns <= now_ns; more = track(next)) {
      inputs = next;
      end_ns = next.now_ns + core::from_seconds(tail_s);
    }
    if (!more && now_ns >= end_ns) break;
    inputs.now_ns = now_ns;
    percept.step(inputs, tone, alarm);
    spatialiser.render(tone, alarm, percept.source_position(), frames);
    for (const float sample : frames)
      samples.push_back(static_cast<std::int16_t>(std::lround(32767.0F * sample)));
  }
  return samples;
}

void add_options(runtime::Command app, RenderRequest& request) {
  app.option("--input", request.input,
             "what was to be heard: a CSV file (columns: see the README) or a recording (MCAP)")
      .required();
  app.option("--out", request.out, "WAV file to write").required();
  app.option("--spectrogram", request.spectrogram, "PNG to write: frequencies and levels over time");
  app.option("--channels", request.channels, "instead of the configuration's: mono, stereo, 5.1, 7.1, hrtf")
      .one_of({"mono", "stereo", "5.1", "7.1", "hrtf"});
}

int run_render(const RenderRequest& request, AudioPerceptConfig config) {
  for (const Layout layout : kLayouts) {
    if (request.channels == name_of(layout)) config.layout = layout;
  }
  const auto samples = render_track(
      [track = read_track(request.input), &request, begin_ns = core::Nanoseconds{0}](Inputs& inputs) mutable {
        if (!track(inputs)) return false;
        if (begin_ns == 0) begin_ns = inputs.now_ns;
        if (core::seconds(inputs.now_ns - begin_ns) > kMax_s)
          throw core::ConfigError(request.input.string() + ": is longer than an hour; allowed: up to 3600 s");
        return true;
      },
      config, kTail_s);
  WavFile wav(request.out, config.layout);
  wav.write(samples);
  std::printf("%s: %.2f s, %s, peak %.3f of full scale\n", request.out.c_str(), wav.seconds(),
              name_of(config.layout), wav.peak());
  if (!request.spectrogram.empty()) {
    draw_spectrogram(samples, config.layout, request.spectrogram);
    std::printf("%s: its spectrogram\n", request.spectrogram.c_str());
  }
  return runtime::kExitDone;
}

}  // namespace phantom::audio_percept
