#pragma once

#include <cstddef>

namespace phantom::audio_percept {

/// Loudspeakers, in the order of a WAV file's channels.
enum class Layout {
  kMono,
  kStereo,  ///< left, right
  k5_1,     ///< front left, front right, centre, low, back left, back right
  k7_1,     ///< the same and side left, side right
  kHrtf     ///< headphones: left and right ear, filtered as a head and its ears would
};
inline constexpr std::size_t kMostChannels = 8;

constexpr std::size_t channel_count(Layout layout) noexcept {
  return layout == Layout::kMono ? 1 : layout == Layout::k5_1 ? 6 : layout == Layout::k7_1 ? 8 : 2;
}

/// As in the configuration.
constexpr const char* name_of(Layout layout) noexcept {
  switch (layout) {
    case Layout::kMono:
      return "mono";
    case Layout::kStereo:
      return "stereo";
    case Layout::k5_1:
      return "5.1";
    case Layout::k7_1:
      return "7.1";
    case Layout::kHrtf:
      break;
  }
  return "hrtf";
}

}  // namespace phantom::audio_percept
