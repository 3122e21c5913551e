#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "components/audio_percept/layout.hpp"

namespace phantom::audio_percept {

/// Draws a sound of 48 kHz (interleaved frames of `layout`) as a picture: above, the level of each frequency
/// from 100 Hz to 10 kHz over time (all channels together, Hann window of 85 ms, −90 to 0 dB of full scale);
/// below, the level of each channel. Throws std::runtime_error if the file cannot be written.
void draw_spectrogram(std::span<const std::int16_t> samples, Layout layout, const std::filesystem::path& png);

}  // namespace phantom::audio_percept
