#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "components/audio_percept/layout.hpp"

namespace phantom::audio_percept {

/// A ring buffer from the audio thread (push) to the thread that writes the file (pop).
class SampleRing {
 public:
  /// Makes room for at least `capacity` samples.
  explicit SampleRing(std::size_t capacity);
  /// Stores all samples, or none if they do not fit; those are counted as dropped. Real-time safe: yes.
  void push(std::span<const std::int16_t> samples) noexcept;
  /// Moves samples into `out`, up to its size. Returns how many. Real-time safe: yes.
  std::size_t pop(std::span<std::int16_t> out) noexcept;
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::vector<std::int16_t> samples_;  // its size is a power of two
  std::atomic<std::uint64_t> written_{0}, read_{0}, dropped_{0};
};

/// A WAV file of 48 kHz and 16 bit. A surround file states which channel is which loudspeaker.
class WavFile {
 public:
  /// Creates the file. Throws std::runtime_error naming the file if that fails.
  WavFile(const std::filesystem::path& path, Layout layout);
  ~WavFile();
  WavFile(WavFile&&) noexcept;

  /// Writes whole frames, interleaved. Throws std::runtime_error if writing fails.
  void write(std::span<const std::int16_t> samples);
  double seconds() const noexcept;
  double peak() const noexcept { return peak_; }  ///< 1 = full scale

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::size_t channels_;
  std::uint64_t samples_ = 0;
  double peak_ = 0.0;
};

}  // namespace phantom::audio_percept
