#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// The inputs over time, read as they are needed: each call sets all inputs as they were from their now_ns
/// on, in the order of time. Returns false after the last. It may throw core::ConfigError.
using Track = std::function<bool(Inputs& inputs)>;

/// Reads a track from CSV (columns: see the README). `name` names the file in messages. Throws
/// core::ConfigError naming line, column, value and what is allowed.
Track read_track_csv(std::istream& csv, const std::string& name);

/// Reads a track from a recording (MCAP) of dds_recorder: its samples of the component's topics, at the times
/// at which they came. Throws core::MissingError if the file does not exist, and core::ConfigError if it is
/// no recording; at its end if it holds no percept.
Track read_track_recording(const std::filesystem::path& file);

/// Reads a `.csv` file, or a recording of dds_recorder (any other name). Throws core::ConfigError,
/// core::MissingError.
Track read_track(const std::filesystem::path& file);

}  // namespace phantom::audio_percept
