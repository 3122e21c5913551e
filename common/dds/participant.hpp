#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/network.hpp"

namespace phantom::dds {

/// Something about DDS that cannot be used: a profile file that does not load, a QoS profile that contradicts the topic's
/// contract, a resource refused. what() names the topic, the file, and what is allowed. Start-up only.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
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
  /// Joins `network.domain` as `component` (the executable's name). Throws DdsError.
  Participant(const std::string& component, const core::NetworkOptions& network);
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
