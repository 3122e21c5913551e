#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "components/audio_percept/config.hpp"
#include "components/audio_percept/track.hpp"

namespace phantom::audio_percept {

/// Renders a track with the same step as the running component, from its first sample to `tail_s` after its
/// last. Returns interleaved frames of 16 bit. Throws core::MissingError if the layout cannot be rendered.
std::vector<std::int16_t> render_track(const Track& track, const AudioPerceptConfig& config, double tail_s);

/// Arguments of `audio_percept render`.
struct RenderRequest {
  std::filesystem::path input, out, spectrogram;
  std::string channels;  ///< empty: as configured
};
void add_options(runtime::Command app, RenderRequest& request);
/// Runs the command. Returns the exit code. Throws core::ConfigError, core::MissingError, std::runtime_error.
int run_render(const RenderRequest& request, AudioPerceptConfig config);

}  // namespace phantom::audio_percept
