#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/percept/tone.hpp"

namespace phantom::percept {

inline constexpr double kRate_Hz = 48000.0;

/// Returns percept and alarm added together.
inline std::vector<float> render(ToneSynthesizer& synthesizer, double duration_s) {
  std::vector<float> samples(static_cast<std::size_t>(std::lround(duration_s * kRate_Hz))), alarm(samples);
  synthesizer.render(samples, alarm);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] += alarm[i];
  return samples;
}

inline double peak(const std::vector<float>& samples) {
  double greatest = 0.0;
  for (float sample : samples) greatest = std::max(greatest, std::abs(static_cast<double>(sample)));
  return greatest;
}

inline double greatest_second_difference(const std::vector<float>& samples) {
  double greatest = 0.0;
  for (std::size_t i = 2; i < samples.size(); ++i) {
    greatest = std::max(greatest,
                        std::abs(static_cast<double>(samples[i]) - 2.0 * static_cast<double>(samples[i - 1]) +
                                 static_cast<double>(samples[i - 2])));
  }
  return greatest;
}

}  // namespace phantom::percept
