#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include "common/dds/admission/refusal_log.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/words.hpp"
#include "components/ros2_gateway/sensors/newest_task.hpp"
#include "components/ros2_gateway/sensors/point_clouds.hpp"
#include "components/ros2_gateway/stream_check.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {

/// Returns a picture's or depth image's message without what this process does not need; `data` is the
/// message's.
inline ImageMessage message_of(const sensor_msgs::msg::dds_::Image_& from) {
  return {from.header().frame_id(), from.height(), from.width(), from.encoding(),
          from.is_bigendian() != 0, from.step(),   from.data()};
}

/// What sensors' messages go through that are handed on: one publisher at a time (StreamCheck), the newest on
/// a thread of its own (NewestTask), what is refused is counted and logged. Any thread.
class SensorStream {
 public:
  /// `what`: in the log, such as "points of a sensor of ROS 2". Others: StreamCheck.
  SensorStream(const char* what, double staleness_s, double largest_stamp_age_s)
      : check_(staleness_s, largest_stamp_age_s), refusals_(what) {}

  /// Returns whether the message is taken; refuses it else.
  template <class Message>
  bool accept(const Message& message, const dds::SampleInfo& info) {
    const std::lock_guard lock(mutex_);
    const core::Status status = check_.accept({ros2::nanoseconds_of(message.header().stamp()), info.writer},
                                              info.received_ns, core::utc_ns());
    return status || refuse(status.message());
  }
  /// Counts and logs a refusal. Returns false.
  bool refuse(const std::string& why) {
    ++refused_;
    refusals_.refused(why);
    return false;
  }
  void put(std::function<void()> task) { task_.put(std::move(task)); }
  void count_handed_on() { ++handed_on_; }
  std::uint64_t handed_on() const { return handed_on_; }
  std::uint64_t refused() const { return refused_; }

 private:
  std::mutex mutex_;
  StreamCheck check_;
  std::atomic<std::uint64_t> handed_on_{0}, refused_{0};
  dds::RefusalLog refusals_;
  NewestTask task_;  // last: what it carries out uses the rest
};

}  // namespace phantom::ros2_gateway
