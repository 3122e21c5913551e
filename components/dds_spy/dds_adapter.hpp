#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/diagnostics/decode.hpp"
#include "common/diagnostics/name_filter.hpp"
#include "components/dds_spy/reading_plan.hpp"
#include "components/dds_spy/system_view.hpp"

namespace phantom::dds_spy {

/// The topics to read, and how.
struct Reading {
  bool read_topics = true;  ///< false: discovery only
  bool ask_types = false;   ///< ask the owners of foreign types to describe them
  diagnostics::NameFilter topics, instances, writers;
  ReadingOptions options;
  diagnostics::DecodeOptions decode;
};

/// A project topic's type and QoS by its contract, for comparison.
struct TopicContract {
  std::string type;
  diagnostics::EndpointQos qos;
};

/// Returns the contracts of the project's topics, by topic name.
const std::map<std::string, TopicContract>& contracts();

/// Joins the domain and passes discovery and samples to a SystemView.
class DdsAdapter {
 public:
  using OnSample = std::function<void(const ReceivedSample&)>;
  /// `on_sample`: called on a middleware thread, with the lock held, for each sample that the filters keep,
  /// after the view has taken it. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const Reading& reading, SystemView& view,
             OnSample on_sample = {});
  ~DdsAdapter();

  /// Creates or replaces readers to match the writers discovered since the last call. To be called several
  /// times a second, without the lock. Returns messages on topics that cannot be read, each once.
  std::vector<std::string> follow_writers();
  /// Returns the lock, which the caller holds while it reads the view.
  std::unique_lock<std::mutex> lock();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::dds_spy
