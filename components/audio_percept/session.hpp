#pragma once

#include <filesystem>

#include "common/core/network.hpp"
#include "components/audio_percept/config.hpp"
#include "components/audio_percept/engine.hpp"
#include "components/audio_percept/sink.hpp"

namespace phantom::audio_percept {

/// Returns the component's health (state, one sentence, figures) from the audio thread's figures.
core::Health health_of(const EngineFigures& figures, const core::LoopStatistics& loop,
                       const std::string& sink_name);

/// Runs the component until a stop is requested. Writes audio.wav and audio_percept.json to the report
/// folder, if one is given. Throws dds::DdsError, std::runtime_error.
void run_session(const AudioPerceptConfig& config, const core::NetworkOptions& network, OpenedSink sink,
                 const std::filesystem::path& report_dir);

}  // namespace phantom::audio_percept
