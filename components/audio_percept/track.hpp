#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// What was to be heard over time: all inputs as they stood from now_ns on, in the order of their times.
using Track = std::vector<Inputs>;

/// Reads a track from CSV (columns: see the README). `name` stands for the file in messages. Throws
/// core::ConfigError naming line, column, value and what is allowed.
Track read_track_csv(std::istream& csv, const std::string& name);

/// A `.csv` file, or a recording of dds_recorder (any other name). Throws core::ConfigError,
/// core::MissingError.
Track read_track(const std::filesystem::path& file);

}  // namespace phantom::audio_percept
