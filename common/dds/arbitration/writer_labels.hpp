#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "common/core/recent_map.hpp"
#include "common/dds/arbitration/discovery.hpp"
#include "common/dds/endpoints/participant_impl.hpp"

namespace phantom::dds {

/// Remembers the USER_DATA of other participants' writers (core::NetworkOptions::model_label), so that a
/// reader knows by which model of arm and cell a sample was made. Bounded; thread-safe. Passes every event on
/// to `next`. Private to common/dds.
class WriterLabels : public DiscoveryEvents {
 public:
  static constexpr std::size_t kMax = 4096, kMaxBytes = 1024;
  using Guid = std::array<std::uint8_t, 16>;

  /// `next`: null if nobody else asks.
  explicit WriterLabels(std::shared_ptr<DiscoveryEvents> next) : next_(std::move(next)) {}

  /// Returns the label of a writer; empty: it has none, or is not known.
  std::string of(const Guid& writer) const {
    const std::lock_guard lock(mutex_);
    const std::string* label = labels_.find(writer);
    return label != nullptr ? *label : "";
  }

  bool asks_for_types() const override { return next_ && next_->asks_for_types(); }
  void on_participant(const FoundParticipant& participant) override {
    if (next_) next_->on_participant(participant);
  }
  void on_authentication(const fast_dds::rtps::GUID_t& guid, bool admitted) override {
    if (next_) next_->on_authentication(guid, admitted);
  }
  void on_endpoint(const FoundEndpoint& endpoint) override {
    note(endpoint);
    if (next_) next_->on_endpoint(endpoint);
  }

 private:
  void note(const FoundEndpoint& endpoint) {
    const bool here = endpoint.event == Discovered::kFound || endpoint.event == Discovered::kChanged;
    const bool labelled = !endpoint.user_data.empty() && endpoint.user_data.size() <= kMaxBytes;
    const std::lock_guard lock(mutex_);
    if (here && endpoint.writer && labelled) {
      labels_.find_or_add(octets_of(endpoint.guid)).first = endpoint.user_data;
    } else {
      labels_.erase(octets_of(endpoint.guid));
    }
  }

  const std::shared_ptr<DiscoveryEvents> next_;
  mutable std::mutex mutex_;
  core::RecentMap<Guid, std::string> labels_{kMax};
};

}  // namespace phantom::dds
