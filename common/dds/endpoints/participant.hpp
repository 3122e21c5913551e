#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/dds/admission/refused_datagrams.hpp"
#include "common/dds/endpoints/documents_end.hpp"

namespace phantom::dds {

class DiscoveryEvents;

/// A problem with DDS: a profile file that does not load, a QoS profile that contradicts the topic's
/// contract, a resource that Fast DDS refuses. what() names the topic, the file, and what is allowed.
/// Start-up only.
class DdsError : public core::ConfigError {
 public:
  using core::ConfigError::ConfigError;
};

/// Loads the profiles and compares each with its topic's contract (common/dds/endpoints/topics.hpp). Throws
/// DdsError naming file, topic, policy, its value and what is allowed; MissingError if there is no such file.
/// Participant's constructor does the same;
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
              std::shared_ptr<DiscoveryEvents> discovery = nullptr);
  ~Participant();
  Participant(Participant&&) = delete;

  const std::string& component() const;
  /// Returns the random number of this run of the process, which goes into every Stamp.
  std::uint64_t session() const;
  /// Returns `network.servo_priority`, which decides the priorities of threads other than those of DDS.
  int servo_priority() const;
  /// Returns the datagrams that were refused before Fast DDS saw them, by reason. Thread-safe.
  std::vector<Refused> refused_datagrams() const;
  /// Logs them now and then, while more come. Not real-time safe; call it from one thread.
  void log_refused_datagrams();
  /// Takes nothing more from another participant, and forgets it, until admit_all(). Thread-safe.
  void suspend(const GuidPrefix& other);
  /// Takes again from everybody that refuse_for_now() named; returns whether there was anybody. Thread-safe.
  bool resume();
  /// Returns a sentence about a component of whose readers and writers some do not become known: mostly, the
  /// network drops fragments of IP. Empty if there is none; on a secured site, where the handshake fails
  /// first and is logged; and with discovery servers. Thread-safe.
  std::string half_known_peer() const;
  /// Returns how many addresses of peers, lost peers and bans were forgotten for others: 0, unless there are
  /// very many or somebody invents them. Thread-safe.
  std::uint64_t forgotten() const;
  /// Returns the security document that ends first; nothing on a site without security. Thread-safe.
  const std::optional<DocumentsEnd>& documents_end() const;
  /// Returns the statistics of every endpoint of this participant. Thread-safe.
  std::vector<core::EndpointStatistics> endpoints() const;

  struct Impl;
  const std::shared_ptr<Impl>& impl() const { return impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace phantom::dds
