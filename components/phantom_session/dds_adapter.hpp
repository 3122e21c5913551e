#pragma once

#include <memory>
#include <mutex>

#include "common/core/network.hpp"
#include "components/phantom_session/collector.hpp"

namespace phantom::phantom_session {

/// Feeds a Collector from the topics of a domain. The collector may be used by others only under lock().
class DdsAdapter {
 public:
  /// Joins the domain. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, Collector& collector);
  ~DdsAdapter();
  std::unique_lock<std::mutex> lock();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_session
