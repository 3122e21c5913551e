#pragma once

#include <memory>
#include <string>

#include "common/core/network.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/diagnostics/graph.hpp"

namespace phantom::observation {

using diagnostics::Presence;

/// Receives the other participants and their endpoints, as discovery reports them. Calls come from middleware
/// threads, one at a time for one participant: copy and return; do not block, throw, or create or delete DDS
/// entities. Of a participant or endpoint that left, only the guid is valid. A participant's endpoints may be
/// reported before it; when it goes, their end may not be reported.
class DiscoveryListener {
 public:
  virtual ~DiscoveryListener() = default;
  virtual void on_participant(const diagnostics::ParticipantInfo& participant, Presence presence) = 0;
  virtual void on_endpoint(const diagnostics::EndpointInfo& endpoint, Presence presence) = 0;
};

/// Whether Observer can ask others to describe their types: Fast DDS 3 can.
bool can_ask_for_types();

/// A participant that observes all others. It neither writes nor announces a type.
class Observer {
 public:
  /// Joins as `component`. `listener` is called from before this constructor returns until this object is
  /// destroyed. `asks_for_types`: it asks the owners of endpoints to describe their types, so that type_of()
  /// knows those that it can decode; an endpoint whose owner announces a description and never gives it is
  /// not reported then. Throws DdsError.
  Observer(const std::string& component, const core::NetworkOptions& network, DiscoveryListener& listener,
           bool asks_for_types = false);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  dds::Participant& participant();
  diagnostics::Guid guid() const;
  /// Returns the name by which participants of this library announce this host in ParticipantInfo::machine;
  /// empty: they do not announce it.
  const std::string& machine() const;

 private:
  struct Discovery;
  std::shared_ptr<Discovery> discovery_;
  dds::Participant participant_;
  std::string machine_;
};

}  // namespace phantom::observation
