#include "components/dds_recorder/adapter/dds_adapter_bag.hpp"

#include <spdlog/fmt/fmt.h>

#include <cstring>
#include <stdexcept>

namespace phantom::dds_recorder {
namespace {

// rmw/types.h
constexpr int kKeepLast = 1, kKeepAll = 2, kRmwReliable = 1, kRmwBestEffort = 2, kRmwTransientLocal = 1,
              kRmwVolatile = 2, kRmwAutomatic = 1;

recording::Bytes bytes_of(const char* text) { return {text, text + std::strlen(text)}; }

std::unique_ptr<recording::FileSink> new_file(const std::filesystem::path& path) {
  auto sink = recording::FileSink::create(path);
  if (!sink) throw std::runtime_error(sink.status().message());
  return std::move(sink).value();
}

}  // namespace

std::string offered_qos_profiles(const dds::QosContract& qos) {
  const char* const infinite = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return fmt::format(
      "- history: {}\n  depth: {}\n  reliability: {}\n  durability: {}\n  deadline:{}  lifespan:{}"
      "  liveliness: {}\n  liveliness_lease_duration:{}  avoid_ros_namespace_conventions: false\n",
      qos.history_depth == 0 ? kKeepAll : kKeepLast, qos.history_depth,
      qos.reliability == dds::Reliability::kReliable ? kRmwReliable : kRmwBestEffort,
      qos.durability == dds::Durability::kTransientLocal ? kRmwTransientLocal : kRmwVolatile, infinite,
      infinite, kRmwAutomatic, infinite);
}

void Ros2Bag::must(bool done, const std::string& what) {
  if (!done) throw std::runtime_error(what);
}

Ros2Bag::Ros2Bag(const std::filesystem::path& path, int zstd_level)
    : sink_(new_file(path)), writer_(*sink_, {.profile = "ros2", .zstd_level = zstd_level}) {}

Ros2Bag::Channel& Ros2Bag::channel(const std::string& topic, const ros2::MessageType& type,
                                   const dds::QosContract& qos) {
  if (const auto known = channels_.find(topic); known != channels_.end()) return known->second;
  std::uint16_t& schema = schemas_[type.name];
  if (schema == 0) {
    const auto made =
        writer_.add_schema({.name = type.name, .encoding = "ros2msg", .data = bytes_of(type.definition)});
    must(made.status());
    schema = *made;
  }
  const auto made = writer_.add_channel(
      {.schema_id = schema,
       .topic = "/" + topic,
       .message_encoding = "cdr",
       .metadata = {{"offered_qos_profiles", offered_qos_profiles(qos)}, {"topic_type_hash", type.hash}}});
  must(made.status());
  return channels_[topic] = {.id = *made, .type = &type};
}

bool Ros2Bag::put(const std::string& topic, const ros2::MessageType& type, const dds::QosContract& qos,
                  recording::ByteView cdr, std::uint64_t log_time_ns, std::uint64_t publish_time_ns) {
  Channel& to = channel(topic, type, qos);
  if (to.type != &type) return false;
  must(writer_.write(recording::Message{.channel_id = to.id,
                                        .sequence = ++to.sequence,
                                        .log_time_ns = log_time_ns,
                                        .publish_time_ns = publish_time_ns,
                                        .data = cdr}));
  return true;
}

void Ros2Bag::finish(const std::string& name) {
  must(writer_.end_chunk());
  // Topics and counts are read from the file itself; without this record newer distributions take the
  // policies' numbers for names.
  const auto& all = writer_.statistics();
  const auto times = fmt::format(
      "duration: {{nanoseconds: {}}}\nstarting_time: {{nanoseconds_since_epoch: {}}}\nmessage_count: {}\n",
      all.message_end_time_ns - all.message_start_time_ns, all.message_start_time_ns, all.message_count);
  std::string file = "  - path: '" + name + "'\n    " + times;
  for (auto at = file.find("\n", 20); at + 1 < file.size(); at = file.find("\n", at + 1))
    if (file.compare(at + 1, 4, "    ") != 0) file.insert(at + 1, "    ");
  must(writer_.write(recording::Metadata{
      "rosbag2",
      {{"serialized_metadata",
        "version: 8\nstorage_identifier: mcap\n" + times +
            "topics_with_message_count: []\ncompression_format: ''\ncompression_mode: ''\n"
            "relative_file_paths: ['" +
            name + "']\nfiles:\n" + file + "custom_data: {}\nros_distro: unknown\n"}}}));
  must(writer_.finish());
  must(sink_->sync());
}

}  // namespace phantom::dds_recorder
