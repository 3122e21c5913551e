#pragma once

#include "components/audio_percept/config.hpp"

namespace phantom::audio_percept {

/// The shipped parameters, mono and without a device.
inline AudioPerceptConfig test_config(Layout layout = Layout::kMono) {
  AudioPerceptConfig config = load_config(PHANTOM_SOURCE_DIR "/components/audio_percept/audio_percept.yaml");
  config.sink = SinkChoice::kPaced;
  config.layout = layout;
  return config;
}

}  // namespace phantom::audio_percept
