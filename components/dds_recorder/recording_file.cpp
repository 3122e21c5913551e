#include "components/dds_recorder/recording_file.hpp"

#include "common/diagnostics/graph.hpp"

namespace phantom::dds_recorder {

recording::StringMap losses_record(const std::vector<TopicInfo>& topics,
                                   const std::vector<TopicLosses>& losses) {
  recording::StringMap record;
  for (std::size_t i = 0; i < losses.size() && i < topics.size(); ++i) {
    for (const auto& [reason, count] : kLossReasons) {
      if (losses[i].*count > 0) record[topics[i].name + "." + reason] = std::to_string(losses[i].*count);
    }
  }
  return record;
}

RecordingFile::RecordingFile(std::filesystem::path path, std::unique_ptr<recording::ByteSink> sink,
                             const recording::WriterOptions& options, const std::vector<TopicInfo>& topics,
                             const DescribeWriter& describe)
    : path_(std::move(path)),
      sink_(std::move(sink)),
      writer_(*sink_, options),
      topics_(topics),
      describe_(describe) {}

core::Expected<std::uint16_t> RecordingFile::schema(const TopicInfo& topic) {
  if (topic.schema_encoding.empty()) return std::uint16_t{0};
  if (const auto known = schemas_.find(topic.type); known != schemas_.end()) return known->second;
  const auto added = writer_.add_schema(
      {0, topic.type, topic.schema_encoding, recording::Bytes(topic.schema.begin(), topic.schema.end())});
  if (added) schemas_[topic.type] = *added;
  return added;
}

core::Expected<std::uint16_t> RecordingFile::channel(const SampleHead& sample, bool carried_over) {
  const std::tuple key(sample.topic, sample.writer, carried_over);
  if (const auto known = channels_.find(key); known != channels_.end()) return known->second;
  if (channels_.size() >= (carried_over ? kMaxChannels / 2 : kMaxChannels))
    return core::Status(core::ErrorCode::kResourceExhausted, "the file has as many channels as it may");
  const TopicInfo& topic = topics_[sample.topic];
  const auto schema_id = schema(topic);
  if (!schema_id) return schema_id;
  const WriterInfo writer = describe_(sample.writer);
  recording::StringMap about{{"type", topic.type},
                             {"keyed", topic.keyed ? "yes" : "no"},
                             {"writer", diagnostics::to_string(sample.writer)},
                             {"component", writer.component},
                             {"host", writer.host},
                             {"process", writer.process},
                             {recording::kPartition, writer.partition}};
  for (const auto& [policy, value] : topic.qos) about["qos." + policy] = value;
  if (carried_over) about[kCarriedOver] = "yes";
  const auto added = writer_.add_channel({0, *schema_id, topic.name, "cdr", std::move(about)});
  if (added) channels_[key] = *added;
  return added;
}

core::Status RecordingFile::write(const SampleView& sample, std::uint64_t log_time_ns, bool carried_over) {
  const auto channel_id = channel(sample.head, carried_over);
  if (!channel_id) return channel_id.status();
  const auto published = static_cast<std::uint64_t>(sample.head.source_utc_ns);
  const core::Status status = writer_.write(
      recording::Message{*channel_id, static_cast<std::uint32_t>(sample.head.sequence_number), log_time_ns,
                         sample.head.source_utc_ns > 0 ? published : log_time_ns, sample.bytes});
  if (status) ++samples_;
  return status;
}

core::Status RecordingFile::finish() {
  if (core::Status status = writer_.finish(); !status) return status;
  return sink_->sync();
}

}  // namespace phantom::dds_recorder
