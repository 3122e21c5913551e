#pragma once

#include <memory>
#include <string>

#include "common/core/network.hpp"
#include "common/dds/participant.hpp"
#include "common/diagnostics/graph.hpp"

namespace phantom::observation {

enum class Presence {
  kAppeared,
  kChanged,
  kLeft,  ///< said so itself
  kLost   ///< participants: silent for its lease
};

/// Who else is there, as discovery tells it. Calls come from middleware threads, one at a time for one
/// participant: copy and return; do not block, throw, or make or end DDS entities. Of what left, only the
/// guid is meant. A participant's endpoints may come before it and may go without a word when it goes.
class DiscoveryListener {
 public:
  virtual ~DiscoveryListener() = default;
  virtual void on_participant(const diagnostics::ParticipantInfo& participant, Presence presence) = 0;
  virtual void on_endpoint(const diagnostics::EndpointInfo& endpoint, Presence presence) = 0;
};

/// A participant that is told of all others. It neither writes nor announces a type.
class Observer {
 public:
  /// Joins as `component`. `listener` hears of others from before this returns until this is destroyed.
  /// Throws DdsError.
  Observer(const std::string& component, const core::NetworkOptions& network, DiscoveryListener& listener);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  dds::Participant& participant();
  diagnostics::Guid guid() const;
  /// This host as participants of this library announce it in ParticipantInfo::machine; empty: they do not.
  const std::string& machine() const;

 private:
  struct Ear;
  std::shared_ptr<Ear> ear_;
  dds::Participant participant_;
  std::string machine_;
};

}  // namespace phantom::observation
