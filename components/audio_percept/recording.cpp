#include "components/audio_percept/recording.hpp"

#include <sndfile.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

SampleRing::SampleRing(std::size_t capacity) : samples_(std::bit_ceil(capacity)) {}

void SampleRing::push(std::span<const std::int16_t> samples) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  if (written - read_.load(std::memory_order_acquire) + samples.size() > samples_.size()) {
    dropped_.fetch_add(samples.size(), std::memory_order_relaxed);
    return;
  }
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples_[(written + i) & (samples_.size() - 1)] = samples[i];
  written_.store(written + samples.size(), std::memory_order_release);
}

std::size_t SampleRing::pop(std::span<std::int16_t> out) noexcept {
  const std::uint64_t read = read_.load(std::memory_order_relaxed);
  const std::uint64_t there = written_.load(std::memory_order_acquire) - read;
  const std::size_t count = std::min<std::size_t>(there, out.size());
  for (std::size_t i = 0; i < count; ++i) out[i] = samples_[(read + i) & (samples_.size() - 1)];
  read_.store(read + count, std::memory_order_release);
  return count;
}

struct WavFile::Impl {
  SNDFILE* file = nullptr;
  std::filesystem::path path;
  ~Impl() {
    if (file != nullptr) sf_close(file);
  }
};

WavFile::WavFile(const std::filesystem::path& path, Layout layout)
    : impl_(std::make_unique<Impl>()), channels_(channel_count(layout)) {
  const bool surround = channels_ > 2;
  SF_INFO format{};
  format.samplerate = static_cast<int>(kSampleRate_Hz);
  format.channels = static_cast<int>(channels_);
  format.format = (surround ? SF_FORMAT_WAVEX : SF_FORMAT_WAV) | SF_FORMAT_PCM_16;
  impl_->path = path;
  impl_->file = sf_open(path.c_str(), SFM_WRITE, &format);
  if (impl_->file == nullptr)
    throw std::runtime_error(path.string() + " cannot be written: " + sf_strerror(nullptr));
  if (!surround) return;
  std::array<int, 8> map{SF_CHANNEL_MAP_LEFT,      SF_CHANNEL_MAP_RIGHT,     SF_CHANNEL_MAP_CENTER,
                         SF_CHANNEL_MAP_LFE,       SF_CHANNEL_MAP_REAR_LEFT, SF_CHANNEL_MAP_REAR_RIGHT,
                         SF_CHANNEL_MAP_SIDE_LEFT, SF_CHANNEL_MAP_SIDE_RIGHT};
  sf_command(impl_->file, SFC_SET_CHANNEL_MAP_INFO, map.data(), static_cast<int>(channels_ * sizeof(int)));
}
WavFile::~WavFile() = default;
WavFile::WavFile(WavFile&&) noexcept = default;

void WavFile::write(std::span<const std::int16_t> samples) {
  const auto count = static_cast<sf_count_t>(samples.size());
  if (sf_write_short(impl_->file, samples.data(), count) != count) {
    throw std::runtime_error(impl_->path.string() + " cannot be written: " + sf_strerror(impl_->file));
  }
  samples_ += samples.size();
  for (std::int16_t sample : samples)
    peak_ = std::max(peak_, std::abs(static_cast<double>(sample)) / 32768.0);
}

double WavFile::seconds() const noexcept {
  return static_cast<double>(samples_ / channels_) / kSampleRate_Hz;
}

}  // namespace phantom::audio_percept
