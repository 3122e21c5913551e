#pragma once

// A bag of ROS 2, as rosbag2's MCAP storage writes it. Part of the DDS adapter.

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "common/dds/endpoints/cdr.hpp"
#include "common/recording/mcap_writer.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/message_types.hpp"

namespace phantom::dds_recorder {

/// Returns `offered_qos_profiles` of a channel: a YAML list with one profile, policies by their numbers in
/// rmw/types.h, as of rosbag2's format 8, which every distribution since Foxy reads.
std::string offered_qos_profiles(const dds::QosContract& qos);

/// One MCAP file with the profile `ros2`: a channel for each topic, with QoS and hash of the type; message
/// encoding `cdr`, schema encoding `ros2msg`. Throws std::runtime_error if it cannot be written. Not
/// thread-safe.
class Ros2Bag {
 public:
  Ros2Bag(const std::filesystem::path& path, int zstd_level);

  /// Writes a message that is already CDR, with its encapsulation header. `topic` has no first slash. Returns
  /// false if the bag has that topic with another type.
  bool put(const std::string& topic, const ros2::MessageType& type, const dds::QosContract& qos,
           recording::ByteView cdr, std::uint64_t log_time_ns, std::uint64_t publish_time_ns);
  /// Writes a message of a known type.
  template <class PubSubType>
  void put(const ros2::TopicName<PubSubType>& topic, const typename PubSubType::type& message,
           std::uint64_t log_time_ns, std::uint64_t publish_time_ns) {
    static const ros2::Topic<PubSubType> of_type("any", {});
    static const dds::CdrCodec codec(of_type.spec());
    must(codec.encode(&message, cdr_), "a message exceeds the bounds of " + topic.name);
    put(topic.name, *ros2::find_message_type(of_type.spec().type_name), topic.qos, cdr_, log_time_ns,
        publish_time_ns);
  }
  /// Ends the file with what `ros2 bag` wants to know of the whole. `name`: of the file when it is done.
  void finish(const std::string& name);
  std::uint64_t messages() const { return writer_.statistics().message_count; }

 private:
  struct Channel {
    std::uint16_t id = 0;
    const ros2::MessageType* type = nullptr;
    std::uint32_t sequence = 0;
  };
  static void must(bool done, const std::string& what);
  static void must(const core::Status& status) { must(static_cast<bool>(status), status.message()); }
  Channel& channel(const std::string& topic, const ros2::MessageType& type, const dds::QosContract& qos);

  std::unique_ptr<recording::FileSink> sink_;
  recording::McapWriter writer_;
  std::map<std::string, Channel> channels_;
  std::map<std::string, std::uint16_t> schemas_;
  std::vector<std::uint8_t> cdr_;
};

}  // namespace phantom::dds_recorder
