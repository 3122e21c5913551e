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

/// A problem with DDS: a profile file that does not load, a QoS profile that contradicts the topic's
/// contract, a resource that Fast DDS refuses. what() names the topic, the file, and what is allowed.
/// Start-up only.
class DdsError : public core::ConfigError {
 public:
  using core::ConfigError::ConfigError;
};

/// Statistics of one endpoint since it was created.
struct EndpointStatistics {
  std::string topic;
  bool writer = false;
  std::uint32_t matched = 0;
  std::uint64_t samples = 0;
  std::uint64_t refused = 0;  ///< samples that the component's validation refused
  std::uint64_t deadline_missed = 0;
  std::uint64_t liveliness_lost = 0;
  std::uint64_t incompatible_qos = 0;
  double busy_s = 0.0;  ///< time that the component's callback has spent on its current sample
};

/// Loads the profiles and compares each with its topic's contract (common/dds/topics.hpp). Throws DdsError
/// naming file, topic, policy, its value and what is allowed. Participant's constructor does the same;
/// --check calls it alone. Thread-safe.
void check_qos_profiles(const std::filesystem::path& qos_profiles);

/// One DDS participant: the process's membership in the domain. Writers and readers keep it alive.
class Participant {
 public:
  /// Joins `network.domain` as `component` (the executable's name). `discovery` receives every other
  /// participant and its endpoints, from the first on (for common/observation; null: nobody). Throws
  /// DdsError, and MissingError if an interface in `network` is missing or does not run. In the haptic path
  /// of a servo (`network.servo_priority`) the thread that receives samples and calls readers' `on_sample`
  /// has SCHED_FIFO, where that is permitted (core/thread_place.hpp). Thread-safe.
  Participant(const std::string& component, const core::NetworkOptions& network,
              std::shared_ptr<eprosima::fastdds::dds::DomainParticipantListener> discovery = nullptr);
  ~Participant();
  Participant(Participant&&) = delete;

  const std::string& component() const;
  /// Returns the random number of this run of the process, which goes into every Stamp.
  std::uint64_t session() const;
  /// Returns `network.servo_priority`, which decides the priorities of threads other than those of DDS.
  int servo_priority() const;
  /// Returns the statistics of every endpoint of this participant. Thread-safe.
  std::vector<EndpointStatistics> endpoints() const;

  struct Impl;
  const std::shared_ptr<Impl>& impl() const { return impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace phantom::dds
