#include "components/audio_percept/spectrogram.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/pictures/png.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {
namespace {

constexpr int kWindow = 4096;  // 85 ms
constexpr int kWidth = 1000, kHeight = 380, kLevelHeight = 120, kLeft = 70, kTop = 30, kGap = 34,
              kBottom = 34;
constexpr double kLowest_Hz = 100.0, kHighest_Hz = 10000.0, kFloor_dB = -90.0, kLevelFloor_dB = -60.0;
const cv::Scalar kInk(60, 60, 60), kGrid(200, 200, 200);
const std::array<cv::Scalar, kMaxChannels> kChannelInks{
    cv::Scalar(200, 90, 20), {40, 40, 210},  {60, 150, 60}, {150, 150, 150},
    {200, 60, 160},          {30, 150, 220}, {120, 90, 60}, {160, 160, 0}};
constexpr std::array<const char*, kMaxChannels> kChannelNames{
    "left", "right", "centre", "low", "back left", "back right", "side left", "side right"};

double decibel(double amplitude, double floor_dB) {
  return std::max(floor_dB, 20.0 * std::log10(std::max(amplitude, 1e-9)));
}

/// Returns the amplitudes at the frequencies k·48000/kWindow around frame `middle`; 1 for a sine of full
/// scale.
std::vector<float> spectrum_at(std::span<const std::int16_t> samples, std::size_t channels, long middle) {
  cv::Mat window(1, kWindow, CV_32F);
  const long frames = static_cast<long>(samples.size() / channels);
  for (int i = 0; i < kWindow; ++i) {
    const long frame = middle - kWindow / 2 + i;
    float sum = 0.0F;
    for (std::size_t c = 0; frame >= 0 && frame < frames && c < channels; ++c)
      sum += samples[static_cast<std::size_t>(frame) * channels + c];
    const double hann = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * i / kWindow);
    window.at<float>(i) = static_cast<float>(hann) * sum / 32768.0F;
  }
  cv::Mat bins;
  cv::dft(window, bins, cv::DFT_COMPLEX_OUTPUT);
  std::vector<float> amplitudes(kWindow / 2);
  for (int k = 0; k < kWindow / 2; ++k) {
    const auto bin = bins.at<cv::Vec2f>(k);
    amplitudes[static_cast<std::size_t>(k)] = std::hypot(bin[0], bin[1]) * 4.0F / kWindow;
  }
  return amplitudes;
}

/// Returns the mean-square level of one channel around frame `middle`, as the amplitude of a sine.
double level_at(std::span<const std::int16_t> samples, std::size_t channels, std::size_t channel,
                long middle) {
  constexpr long kHalf = 480;
  const long frames = static_cast<long>(samples.size() / channels);
  double sum = 0.0;
  for (long frame = std::max(0L, middle - kHalf); frame < std::min(frames, middle + kHalf); ++frame) {
    const double sample = samples[static_cast<std::size_t>(frame) * channels + channel] / 32768.0;
    sum += sample * sample;
  }
  return std::sqrt(2.0 * sum / (2.0 * kHalf));
}

double frequency_of_row(int row) {
  return kHighest_Hz * std::pow(kLowest_Hz / kHighest_Hz, static_cast<double>(row) / (kHeight - 1));
}
int row_of_frequency(double frequency_Hz) {
  return static_cast<int>(
      std::lround((kHeight - 1) * std::log(frequency_Hz / kHighest_Hz) / std::log(kLowest_Hz / kHighest_Hz)));
}

void write(cv::Mat& picture, const std::string& text, cv::Point at) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, kInk, 1, cv::LINE_AA);
}

cv::Mat draw_frequencies(std::span<const std::int16_t> samples, std::size_t channels) {
  const double frames = static_cast<double>(samples.size() / channels);
  cv::Mat levels(kHeight, kWidth, CV_8U);
  for (int x = 0; x < kWidth; ++x) {
    const auto amplitudes = spectrum_at(samples, channels, std::lround((x + 0.5) / kWidth * frames));
    for (int y = 0; y < kHeight; ++y) {
      const double bin = frequency_of_row(y) * kWindow / kSampleRate_Hz;
      const auto k = std::min(static_cast<std::size_t>(bin), amplitudes.size() - 2);
      const double amplitude =
          std::lerp(amplitudes[k], amplitudes[k + 1], static_cast<float>(bin - static_cast<double>(k)));
      levels.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(255.0 * (1.0 - decibel(amplitude, kFloor_dB) / kFloor_dB));
    }
  }
  cv::Mat colours;
  cv::applyColorMap(levels, colours, cv::COLORMAP_INFERNO);
  return colours;
}

cv::Mat draw_levels(std::span<const std::int16_t> samples, std::size_t channels) {
  const double frames = static_cast<double>(samples.size() / channels);
  cv::Mat picture(kLevelHeight, kWidth, CV_8UC3, cv::Scalar::all(255));
  for (int y = 1; y < 3; ++y)
    cv::line(picture, {0, y * kLevelHeight / 3}, {kWidth, y * kLevelHeight / 3}, kGrid);
  for (std::size_t c = 0; c < channels; ++c) {
    std::vector<cv::Point> line;
    for (int x = 0; x < kWidth; ++x) {
      const double level_dB =
          decibel(level_at(samples, channels, c, std::lround((x + 0.5) / kWidth * frames)), kLevelFloor_dB);
      line.emplace_back(x, static_cast<int>(std::lround((kLevelHeight - 1) * level_dB / kLevelFloor_dB)));
    }
    cv::polylines(picture, line, false, kChannelInks[c], 1, cv::LINE_AA);
  }
  return picture;
}

void draw_axes(cv::Mat& picture, double length_s, Layout layout) {
  for (const double frequency_Hz : {100, 200, 500, 1000, 2000, 5000, 10000}) {
    const int y = kTop + row_of_frequency(frequency_Hz);
    cv::line(picture, {kLeft - 5, y}, {kLeft, y}, kInk);
    write(picture, cv::format("%g", frequency_Hz), {kLeft - 50, y + 4});
  }
  write(picture, "Hz", {kLeft - 50, kTop - 12});
  const int level_top = kTop + kHeight + kGap;
  for (int i = 0; i <= 3; ++i)
    write(picture, cv::format("%d dB", -20 * i), {kLeft - 55, level_top + 4 + i * kLevelHeight / 3});
  int x = kLeft;
  for (std::size_t c = 0; c < channel_count(layout); ++c) {
    const std::string name = layout == Layout::kMono ? "level" : kChannelNames[c];
    cv::line(picture, {x, level_top - 12}, {x + 18, level_top - 12}, kChannelInks[c], 2);
    write(picture, name, {x + 23, level_top - 8});
    x += 45 + 8 * static_cast<int>(name.size());
  }
  const double step_s = std::pow(10.0, std::ceil(std::log10(length_s / 12.0)));
  const double tick_s = length_s / step_s < 5.0 ? step_s / 4.0 : step_s;
  for (double t = 0.0; t <= length_s; t += tick_s) {
    const int at = kLeft + static_cast<int>(std::lround(kWidth * t / length_s));
    cv::line(picture, {at, level_top + kLevelHeight}, {at, level_top + kLevelHeight + 5}, kInk);
    write(picture, cv::format("%g s", t), {at - 8, level_top + kLevelHeight + 20});
  }
}

}  // namespace

void draw_spectrogram(std::span<const std::int16_t> samples, Layout layout,
                      const std::filesystem::path& png) {
  const std::size_t channels = channel_count(layout);
  const int level_top = kTop + kHeight + kGap;
  cv::Mat picture(level_top + kLevelHeight + kBottom, kLeft + kWidth + 20, CV_8UC3, cv::Scalar::all(255));
  draw_frequencies(samples, channels).copyTo(picture(cv::Rect(kLeft, kTop, kWidth, kHeight)));
  draw_levels(samples, channels).copyTo(picture(cv::Rect(kLeft, level_top, kWidth, kLevelHeight)));
  cv::rectangle(picture, cv::Rect(kLeft, level_top, kWidth, kLevelHeight), kInk);
  draw_axes(picture, static_cast<double>(samples.size() / channels) / kSampleRate_Hz, layout);
  const auto bytes = pictures::encode_png(picture.data, picture.cols, picture.rows, picture.step[0]);
  bool written = false;
  if (png.extension() == ".png") {
    std::ofstream file(png, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    written = static_cast<bool>(file.flush());
  }
  if (!written)
    throw std::runtime_error(png.string() + " cannot be written; allowed: a path that ends in .png");
}

}  // namespace phantom::audio_percept
