#pragma once

#include <filesystem>

#include "components/audio_percept/track.hpp"

namespace phantom::audio_percept {

/// The track of a recording (MCAP) of dds_recorder: its samples of the component's topics, at the times at
/// which they came. Throws core::MissingError if there is no such file, core::ConfigError if it is no
/// recording or holds no percept.
Track read_track_recording(const std::filesystem::path& file);

}  // namespace phantom::audio_percept
