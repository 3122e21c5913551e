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

/// What the spy reads, and how.
struct Reading {
  bool read_topics = true;  ///< false: discovery alone
  diagnostics::NameFilter topics, instances, writers;
  ReadingOptions options;
  diagnostics::DecodeOptions decode;
};

/// A topic of the project as its contract has it, for comparison.
struct TopicContract {
  std::string type;
  diagnostics::EndpointQos qos;
};

/// The project's topics by name.
const std::map<std::string, TopicContract>& contracts();

/// Joins the domain and tells a SystemView of what is there and what comes.
class DdsAdapter {
 public:
  using OnSample = std::function<void(const HeardSample&)>;
  /// `on_sample` is called for each sample that the filters keep, after the view was told, on a middleware
  /// thread with the lock held. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const Reading& reading, SystemView& view,
             OnSample on_sample = {});
  ~DdsAdapter();

  /// Makes the readers that the writers found since then call for. Call it some times a second, without the
  /// lock. Returns sentences on topics that cannot be read, each once.
  std::vector<std::string> follow_writers();
  /// Held while the view is read.
  std::unique_lock<std::mutex> lock();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::dds_spy
