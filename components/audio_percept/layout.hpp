#pragma once

#include <array>
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
inline constexpr std::size_t kMaxChannels = 8;

constexpr std::size_t channel_count(Layout layout) noexcept {
  return layout == Layout::kMono ? 1 : layout == Layout::k5_1 ? 6 : layout == Layout::k7_1 ? 8 : 2;
}

inline constexpr std::array kLayouts{Layout::kMono, Layout::kStereo, Layout::k5_1, Layout::k7_1,
                                     Layout::kHrtf};

/// Returns the name used in the configuration.
constexpr const char* name_of(Layout layout) noexcept {
  constexpr std::array kNames{"mono", "stereo", "5.1", "7.1", "hrtf"};
  return kNames[static_cast<std::size_t>(layout)];
}

}  // namespace phantom::audio_percept
