#pragma once

#include <memory>
#include <mutex>

#include "common/core/network.hpp"
#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/joint_log.hpp"

namespace phantom::phantom_session {

/// Feeds a Collector and a JointLog from the topics of a domain. Other users of these hold lock().
class DdsAdapter {
 public:
  /// Joins the domain. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, Collector& collector, JointLog& joints);
  ~DdsAdapter();
  std::unique_lock<std::mutex> lock();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_session
