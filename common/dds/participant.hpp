#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/core/health.hpp"

namespace phantom::dds {

/// Something about DDS that cannot be used: a profile file that does not load, a QoS profile that contradicts the topic's
/// contract, a resource refused. what() names the topic, the file, and what is allowed. Start-up only.
class DdsError;

/// Where and how a process takes part.
struct ParticipantOptions {
  std::string component;                   ///< executable's name; becomes the participant's
  int domain = 0;
  std::filesystem::path qos_profiles;      ///< XML file with the topics' profiles
  std::vector<std::string> interfaces;     ///< IP addresses to use; empty: all
  std::vector<std::string> initial_peers;  ///< addresses to announce to; empty: multicast discovery
  bool shared_memory = false;              ///< add the shared-memory transport to UDP
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
};

/// One DDS participant: the process's membership in the domain. Writers and readers keep it alive.
class Participant {
 public:
  /// Throws DdsError.
  explicit Participant(const ParticipantOptions& options);
  ~Participant();
  Participant(Participant&&) = delete;

  const std::string& component() const;
  /// Random number of this process start; goes into every Stamp.
  std::uint64_t session() const;
  /// Statistics of every endpoint made from this participant. Thread-safe.
  std::vector<EndpointStatistics> endpoints() const;

  struct Impl;
  const std::shared_ptr<Impl>& impl() const { return impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace phantom::dds
