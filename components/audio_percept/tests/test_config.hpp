#pragma once

#include "components/audio_percept/config.hpp"

namespace phantom::audio_percept {

inline AudioPerceptConfig test_config() {
  AudioPerceptConfig config = load_config(PHANTOM_SOURCE_DIR "/components/audio_percept/audio_percept.yaml");
  config.sink = SinkChoice::kPaced;
  return config;
}

}  // namespace phantom::audio_percept
