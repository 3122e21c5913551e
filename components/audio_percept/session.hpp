#pragma once

#include <filesystem>

#include "common/core/network.hpp"
#include "components/audio_percept/config.hpp"
#include "components/audio_percept/engine.hpp"
#include "components/audio_percept/sink.hpp"

namespace phantom::audio_percept {

/// Health from what the audio thread says: state, one sentence, figures.
core::Health health_of(const EngineFigures& figures, const core::LoopStatistics& loop,
                       const std::string& sink_name);

/// Makes the sound until a stop is requested. With a report folder, leaves audio.wav and audio_percept.json
/// in it. Throws dds::DdsError, std::runtime_error.
void run_session(const AudioPerceptConfig& config, const core::NetworkOptions& network, OpenedSink sink,
                 const std::filesystem::path& report_dir);

}  // namespace phantom::audio_percept
