#pragma once

#include <filesystem>

#include "components/audio_percept/track.hpp"

namespace phantom::audio_percept {

/// Reads a track from a recording (MCAP) of dds_recorder: its samples of the component's topics, at the times
/// at which they came. Throws core::MissingError if the file does not exist, and core::ConfigError if it is
/// no recording or holds no percept.
Track read_track_recording(const std::filesystem::path& file);

}  // namespace phantom::audio_percept
