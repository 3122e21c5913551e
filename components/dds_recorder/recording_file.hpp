#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <tuple>

#include "common/recording/mcap_writer.hpp"
#include "common/recording/recordings.hpp"
#include "components/dds_recorder/losses.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Names of the records that this component writes into a file besides samples; README.md describes them.
inline constexpr const char* kAboutRecord = "phantom.recording";
inline constexpr const char* kLossesRecord = "phantom.losses";
inline constexpr const char* kTriggerRecord = "phantom.trigger";
inline constexpr const char* kEndRecord = "phantom.end";
inline constexpr const char* kLeftOutRecord = "phantom.left_out";
using recording::kCarriedOver;

/// The writer of a topic, as far as discovery has reported it.
struct WriterInfo {
  std::string component, host, process;
  std::string partition;  ///< that it writes in; empty: the default one, or not known
};
using DescribeWriter = std::function<WriterInfo(const Guid&)>;

/// One MCAP file of a recording, with a channel for each topic and writer. Not thread-safe.
class RecordingFile {
 public:
  /// A file has so many channels: each keeps about 2 kB until the file ends, and who comes and goes brings
  /// new ones. Half of them at most are of samples that were there before the file began.
  static constexpr std::size_t kMaxChannels = 16384;

  /// All arguments but `sink` outlive this object.
  RecordingFile(std::filesystem::path path, std::unique_ptr<recording::ByteSink> sink,
                const recording::WriterOptions& options, const std::vector<TopicInfo>& topics,
                const DescribeWriter& describe);

  /// `carried_over`: the sample was there before the file began, and is written at its start so that the file
  /// is complete in itself. Returns kResourceExhausted, with status() good, if it needs a channel for which
  /// there is no room.
  core::Status write(const SampleView& sample, std::uint64_t log_time_ns, bool carried_over);
  core::Status note(const char* name, recording::StringMap values) {
    return writer_.write(recording::Metadata{name, std::move(values)});
  }
  core::Status attach(const recording::Attachment& attachment) { return writer_.write(attachment); }
  core::Status flush() { return writer_.end_chunk(); }
  core::Status sync() { return sink_->sync(); }
  core::Status finish();

  const std::filesystem::path& path() const { return path_; }
  /// Returns the bytes in the file, plus the uncompressed bytes of the chunk that is being filled.
  std::uint64_t bytes() const { return writer_.bytes_written() + writer_.bytes_waiting(); }
  std::uint64_t samples() const { return samples_; }
  /// Returns whether more can be written; otherwise the error.
  const core::Status& status() const { return writer_.status(); }

 private:
  core::Expected<std::uint16_t> channel(const SampleHead& sample, bool carried_over);
  core::Expected<std::uint16_t> schema(const TopicInfo& topic);

  std::filesystem::path path_;
  std::unique_ptr<recording::ByteSink> sink_;
  recording::McapWriter writer_;
  const std::vector<TopicInfo>& topics_;
  const DescribeWriter& describe_;
  std::map<std::tuple<TopicNumber, Guid, bool>, std::uint16_t> channels_;
  std::map<std::string, std::uint16_t> schemas_;
  std::uint64_t samples_ = 0;
};

/// Returns the content of phantom.losses: for each topic the counts that are not 0, as "TOPIC.missing",
/// "TOPIC.superseded" …
recording::StringMap losses_record(const std::vector<TopicInfo>& topics,
                                   const std::vector<TopicLosses>& losses);

}  // namespace phantom::dds_recorder
