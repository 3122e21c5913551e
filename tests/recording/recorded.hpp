#pragma once

// The recorder's executable in a folder of its own, and what it records.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <thread>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/observation/payload_writer.hpp"
#include "common/recording/mcap_check.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/frozen_thread.hpp"

namespace phantom::recorder_process {

using dds::eventually;
using dds::test_network;
using test::Process;
using test::read_text;
using testing::HasSubstr;

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    std::string topology = read_text(PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml");
    for (auto at = topology.find("../"); at != std::string::npos; at = topology.find("../", at + 1))
      topology.replace(at, 3, PHANTOM_SOURCE_DIR "/deploy/");
    std::ofstream(folder / "topology.yaml") << topology;
    std::ofstream(folder / "config.yaml")
        << "disk: {margin_MB: 0}\nflush_interval_s: 0.02\nchunk_kB: 4\nqueue_MB: 4\n"
           "window: {before_s: 5, after_s: 1}\n";
  }
  void TearDown() override {
    if (!HasFailure()) std::filesystem::remove_all(folder);
  }

  std::vector<std::string> command(const std::string& what, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{PHANTOM_BIN_DIR "/dds_recorder",
                                       what,
                                       "--domain",
                                       std::to_string(test_network().domain),
                                       "--deployment",
                                       (folder / "topology.yaml").string(),
                                       "--config",
                                       (folder / "config.yaml").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  int run(const std::string& what, const std::vector<std::string>& more, std::string* output = nullptr) {
    Process process(command(what, more), folder / (what + ".log"));
    const int code = process.wait();
    if (output != nullptr) *output = process.output();
    return code;
  }
  static std::vector<std::filesystem::path> files_in(const std::filesystem::path& where) {
    std::vector<std::filesystem::path> files;
    if (!std::filesystem::exists(where)) return files;
    for (const auto& entry : std::filesystem::directory_iterator(where)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }
  /// Topics whose samples have reached the disk, of a recording that may go on.
  static std::set<std::string> topics_in(const std::filesystem::path& where) {
    std::set<std::string> topics;
    for (const auto& file : files_in(where)) {
      const auto reader = recording::McapReader::open(file);
      if (!reader) continue;
      recording::MessageCursor cursor(*reader);
      for (recording::Message message; cursor.next(message);)
        topics.insert(reader->channels().at(message.channel_id).topic);
    }
    return topics;
  }
  /// Numbers of the alerts in a file, each of which must be as it was written.
  static std::vector<std::uint32_t> alerts_in(const recording::McapReader& reader) {
    std::vector<std::uint32_t> numbers;
    recording::MessageCursor cursor(reader);
    for (recording::Message message; cursor.next(message);) {
      if (reader.channels().at(message.channel_id).topic != "hit_alert") continue;
      msg::HitAlert alert;
      EXPECT_TRUE(dds::decode(dds::kHitAlert, message.data, alert));
      EXPECT_EQ(alert.mu(), 3.0 * alert.alert());
      EXPECT_EQ(alert.stamp().sequence_number(), alert.alert());
      numbers.push_back(alert.alert());
    }
    EXPECT_TRUE(cursor.problems().empty());
    return numbers;
  }

  /// Number of the last alert that has reached the disk, of a recording that may go on; 0: none.
  static int last_alert_in(const std::filesystem::path& where) {
    std::uint32_t last = 0;
    for (const auto& file : files_in(where)) {
      const auto reader = recording::McapReader::open(file);
      if (!reader) continue;
      recording::MessageCursor cursor(*reader);
      for (recording::Message message; cursor.next(message);) {
        msg::HitAlert alert;
        if (reader->channels().at(message.channel_id).topic != "hit_alert") continue;
        if (dds::decode(dds::kHitAlert, message.data, alert)) last = std::max(last, alert.alert());
      }
    }
    return static_cast<int>(last);
  }

  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("phantom_recorder_" + std::to_string(getpid()));
};

/// Writes numbered alerts for as long as it lives. Keeps 4,000 of them, not the 64 of the topic's
/// contract: a recorder that a loaded machine lets wait misses none.
class AlertWriter {
 public:
  explicit AlertWriter(std::chrono::microseconds period)
      : thread_([this, period](const std::stop_token& stop) {
          dds::Stamper stamper(participant_);
          const dds::CdrCodec codec(dds::kHitAlert);
          std::vector<std::uint8_t> bytes;
          while (!stop.stop_requested()) {
            msg::HitAlert alert;
            alert.stamp(stamper.next());
            alert.alert(static_cast<std::uint32_t>(alert.stamp().sequence_number()));
            alert.mu(3.0 * alert.alert());
            alert.cleared(true);
            codec.encode(&alert, bytes);
            writer_.write(bytes);
            ++written_;
            std::this_thread::sleep_for(period);
          }
        }) {}
  std::uint32_t matched() const { return writer_.matched(); }
  std::uint32_t written() const { return written_; }

 private:
  dds::Participant participant_{"phantom_sensing", test_network()};
  observation::PayloadWriter writer_{participant_,
                                     {dds::kHitAlert.name, dds::kHitAlert.type_name},
                                     {.reliability = diagnostics::Reliability::kReliable},
                                     4'000};
  std::atomic<std::uint32_t> written_{0};
  std::jthread thread_;
};

}  // namespace phantom::recorder_process
