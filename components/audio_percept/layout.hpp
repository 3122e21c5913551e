#pragma once

#include <cstddef>

namespace phantom::audio_percept {

/// Loudspeaker layouts, with the loudspeakers in the order of a WAV file's channels.
enum class Layout {
  kMono,
  kStereo,  ///< left, right
  k5_1,     ///< front left, front right, centre, low frequency, back left, back right
  k7_1,     ///< the same, then side left, side right
  kHrtf     ///< headphones: left and right ear, filtered by a head-related transfer function
};
inline constexpr std::size_t kMostChannels = 8;

constexpr std::size_t channel_count(Layout layout) noexcept {
  return layout == Layout::kMono ? 1 : layout == Layout::k5_1 ? 6 : layout == Layout::k7_1 ? 8 : 2;
}

/// Returns the name used in the configuration.
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
