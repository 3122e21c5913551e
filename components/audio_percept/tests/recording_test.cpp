#include "components/audio_percept/recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>
#include <unistd.h>

#include <array>
#include <thread>
#include <vector>

namespace phantom::audio_percept {
namespace {

TEST(SampleRing, CarriesASequenceBetweenTwoThreadsWhole) {
  SampleRing ring(1024);
  constexpr int kTotal = 200'000;
  std::thread writer([&] {
    std::array<std::int16_t, 100> block{};
    for (int i = 0; i < kTotal;) {
      for (int k = 0; k < 100; ++k)
        block[static_cast<std::size_t>(k)] = static_cast<std::int16_t>((i + k) % 30011);
      const std::uint64_t dropped = ring.dropped();
      ring.push(block);
      if (ring.dropped() == dropped)
        i += 100;  // a block without room is tried again
      else
        std::this_thread::yield();
    }
  });
  int next = 0, wrong = 0;
  std::array<std::int16_t, 333> out{};
  while (next < kTotal) {
    const std::size_t count = ring.pop(out);
    for (std::size_t k = 0; k < count; ++k) wrong += out[k] != static_cast<std::int16_t>(next++ % 30011);
  }
  writer.join();
  EXPECT_EQ(wrong, 0);
}

TEST(SampleRing, TakesAllOrNothingAndCountsWhatItDrops) {
  SampleRing ring(256);
  const std::vector<std::int16_t> block(200, 7);
  ring.push(block);
  ring.push(block);
  EXPECT_EQ(ring.dropped(), 200U);
  std::vector<std::int16_t> out(400);
  EXPECT_EQ(ring.pop(out), 200U);
  EXPECT_EQ(ring.pop(out), 0U);
}

TEST(WavFile, HoldsTheSamplesAt48kHz16BitMono) {
  const auto path =
      std::filesystem::temp_directory_path() / ("recording_test_" + std::to_string(getpid()) + ".wav");
  const std::vector<std::int16_t> samples{0, 100, -16384, 32767, 5};
  {
    WavFile wav(path, Layout::kMono);
    wav.write(samples);
    wav.write(samples);
    EXPECT_DOUBLE_EQ(wav.seconds(), 10.0 / 48000.0);
    EXPECT_NEAR(wav.peak(), 1.0, 1e-4);
  }
  SF_INFO format{};
  SNDFILE* file = sf_open(path.c_str(), SFM_READ, &format);
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(format.samplerate, 48000);
  EXPECT_EQ(format.channels, 1);
  EXPECT_EQ(format.format, SF_FORMAT_WAV | SF_FORMAT_PCM_16);
  std::vector<std::int16_t> read(10);
  EXPECT_EQ(sf_read_short(file, read.data(), 10), 10);
  sf_close(file);
  std::filesystem::remove(path);
  EXPECT_TRUE(std::equal(samples.begin(), samples.end(), read.begin() + 5));
}

TEST(WavFile, SaysWhichChannelIsWhichLoudspeaker) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("recording_test_surround_" + std::to_string(getpid()) + ".wav");
  {
    WavFile wav(path, Layout::k5_1);
    wav.write(std::vector<std::int16_t>(6 * 480, 100));
    EXPECT_DOUBLE_EQ(wav.seconds(), 0.01);
  }
  SF_INFO format{};
  SNDFILE* file = sf_open(path.c_str(), SFM_READ, &format);
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(format.channels, 6);
  EXPECT_EQ(format.frames, 480);
  std::array<int, 6> map{};
  EXPECT_TRUE(sf_command(file, SFC_GET_CHANNEL_MAP_INFO, map.data(), sizeof map));
  sf_close(file);
  std::filesystem::remove(path);
  EXPECT_EQ(map,
            (std::array<int, 6>{SF_CHANNEL_MAP_LEFT, SF_CHANNEL_MAP_RIGHT, SF_CHANNEL_MAP_CENTER,
                                SF_CHANNEL_MAP_LFE, SF_CHANNEL_MAP_REAR_LEFT, SF_CHANNEL_MAP_REAR_RIGHT}));
}

TEST(WavFile, NamesTheFileThatCannotBeWritten) {
  try {
    WavFile wav("/nowhere/audio.wav", Layout::kStereo);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere/audio.wav"));
  }
}

}  // namespace
}  // namespace phantom::audio_percept
