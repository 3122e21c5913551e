#pragma once

namespace phantom::percept {

/// Range of loudness levels for which ISO 226 gives contours over the whole frequency range.
inline constexpr double kMinPhon = 20.0, kMaxPhon = 80.0;

/// Returns the sound pressure level of a pure tone that sounds as loud as a tone of `phon` dB at 1 kHz. This
/// is the normal equal-loudness-level contour of ISO 226:2003 (eq. 1, table 1), interpolated linearly over
/// the logarithm of the frequency between the table's third octaves. `frequency_Hz` is clamped to 20…12500
/// Hz, `phon` to kMinPhon…kMaxPhon. Real-time safe: yes.
double equal_loudness_level_dB(double frequency_Hz, double phon) noexcept;

/// Returns the greatest level of that contour between two frequencies (low ≤ high), where the ear is least
/// sensitive. Real-time safe: yes.
double greatest_equal_loudness_level_dB(double low_Hz, double high_Hz, double phon) noexcept;

}  // namespace phantom::percept
