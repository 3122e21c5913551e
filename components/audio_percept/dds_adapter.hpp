#pragma once

#include <memory>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "components/audio_percept/inbox.hpp"

namespace phantom::audio_percept {

/// The component's DDS readers and writers. In: percept, master_state, slave_state, hit_alert,
/// operator_command and view_pose. Out: component_status. Samples that are out of order, out of range or not
/// finite are refused and counted; the others go to the inbox. Of each topic that only one process may send,
/// the adapter follows the first sender for as long as that one is heard.
class DdsAdapter {
 public:
  /// Throws dds::DdsError. `inbox` must outlive the adapter.
  DdsAdapter(const core::NetworkOptions& network, Inbox& inbox);
  ~DdsAdapter();

  /// Publishes component_status, degraded while a second process sends a topic that only one may send. One
  /// thread.
  void report(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::audio_percept
