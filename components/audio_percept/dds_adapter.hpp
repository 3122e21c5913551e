#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "components/audio_percept/inbox.hpp"

namespace phantom::audio_percept {

/// The component's ends in the data space: percept, master_state, slave_state, hit_alert,
/// operator_command and view_pose in, component_status out. Samples that are out of order, out of range or
/// not finite are refused and counted; the others go to the inbox. Of each topic that one process sends it
/// keeps to the first, for as long as that one is heard.
class DdsAdapter {
 public:
  /// Throws dds::DdsError. `inbox` must outlive the adapter.
  DdsAdapter(const core::NetworkOptions& network, Inbox& inbox);
  ~DdsAdapter();

  /// Publishes component_status, degraded while a second process sends what one alone may. One thread.
  void report(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::audio_percept
