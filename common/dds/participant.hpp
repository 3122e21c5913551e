#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/core/network.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipantListener;
}

namespace phantom::dds {

/// Something about DDS that cannot be used: a profile file that does not load, a QoS profile that contradicts
/// the topic's contract, a resource refused. what() names the topic, the file, and what is allowed. Start-up
/// only.
class DdsError : public core::ConfigError {
 public:
  using core::ConfigError::ConfigError;
};

/// What DDS reported about one endpoint since it was made.
struct EndpointStatistics {
  std::string topic;
  bool writer = false;
  std::uint32_t matched = 0;
  std::uint64_t samples = 0;
  std::uint64_t refused = 0;  ///< set by the component: samples its validation refused
  std::uint64_t deadline_missed = 0;
  std::uint64_t liveliness_lost = 0;
  std::uint64_t incompatible_qos = 0;
  double busy_s = 0.0;  ///< for so long the component has been at the sample that it was given last
};

/// Loads the profiles and compares every topic's with its contract (common/dds/topics.hpp). Throws DdsError
/// naming file, topic, policy, what it says and what is allowed. Participant's constructor does the same;
/// --check calls it alone. Thread-safe.
void check_qos_profiles(const std::filesystem::path& qos_profiles);

/// One DDS participant: the process's membership in the domain. Writers and readers keep it alive.
class Participant {
 public:
  /// Joins `network.domain` as `component` (the executable's name). `discovery` is told of every other
  /// participant and its endpoints, from the first on (for common/observation; null: nobody). Throws
  /// DdsError, and MissingError if an interface that it is to use is not there or does not run. In the
  /// haptic path of a servo (`network.servo_priority`) the thread that receives samples and calls readers'
  /// `on_sample` has SCHED_FIFO, where that is permitted (core/thread_place.hpp). Thread-safe.
  Participant(const std::string& component, const core::NetworkOptions& network,
              std::shared_ptr<eprosima::fastdds::dds::DomainParticipantListener> discovery = nullptr);
  ~Participant();
  Participant(Participant&&) = delete;

  const std::string& component() const;
  /// Random number of this process start; goes into every Stamp.
  std::uint64_t session() const;
  /// `network.servo_priority`, by which threads beside those of DDS take their places.
  int servo_priority() const;
  /// Statistics of every endpoint made from this participant. Thread-safe.
  std::vector<EndpointStatistics> endpoints() const;

  struct Impl;
  const std::shared_ptr<Impl>& impl() const { return impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace phantom::dds
