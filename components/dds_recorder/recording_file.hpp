#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <tuple>

#include "common/recording/mcap_writer.hpp"
#include "components/dds_recorder/losses.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Names of what this component writes into a file beside the samples; README.md says what each holds.
inline constexpr const char* kAboutRecord = "phantom.recording";
inline constexpr const char* kLossesRecord = "phantom.losses";
inline constexpr const char* kTriggerRecord = "phantom.trigger";
inline constexpr const char* kEndRecord = "phantom.end";
/// A channel's metadata: its samples were there before the file began.
inline constexpr const char* kCarriedOver = "carried_over";

/// Who writes on a topic, as far as discovery told.
struct WriterInfo {
  std::string component, host, process;
};
using DescribeWriter = std::function<WriterInfo(const Guid&)>;

/// One MCAP file of a recording: a channel for every topic and writer. Not thread-safe.
class RecordingFile {
 public:
  /// All but `sink` outlive this.
  RecordingFile(std::filesystem::path path, std::unique_ptr<recording::ByteSink> sink,
                const recording::WriterOptions& options, const std::vector<TopicInfo>& topics,
                const DescribeWriter& describe);

  /// `carried_over`: the sample was there before the file began, and is written at its start for those who
  /// read it alone.
  core::Status write(const SampleView& sample, std::uint64_t log_time_ns, bool carried_over);
  core::Status note(const char* name, recording::StringMap values) {
    return writer_.write(recording::Metadata{name, std::move(values)});
  }
  core::Status attach(const recording::Attachment& attachment) { return writer_.write(attachment); }
  core::Status flush() { return writer_.end_chunk(); }
  core::Status sync() { return sink_->sync(); }
  core::Status finish();

  const std::filesystem::path& path() const { return path_; }
  /// Bytes in the file, and those to come of the chunk that is being filled, uncompressed.
  std::uint64_t bytes() const { return writer_.bytes_written() + writer_.bytes_waiting(); }
  std::uint64_t samples() const { return samples_; }
  /// Whether anything more can be written.
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

/// What phantom.losses holds: for each topic with a count that is not 0 "TOPIC.missing", "TOPIC.superseded" …
recording::StringMap losses_record(const std::vector<TopicInfo>& topics,
                                   const std::vector<TopicLosses>& losses);
/// "01.0f.…" as DDS tools write it.
std::string guid_text(const Guid& guid);

}  // namespace phantom::dds_recorder
