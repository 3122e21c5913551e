#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "components/dds_recorder/dds_recorder.hpp"
#include "components/dds_recorder/sample_queue.hpp"

namespace phantom::dds_recorder {

/// Subscribes to topics: the project's from the start, others once one of their writers is discovered. Puts
/// the bytes of every sample into the queue. Announces itself and its state as every component does.
class DdsAdapter {
 public:
  using KeepsTopic = std::function<bool(const std::string&)>;
  /// Joins the data space, without any subscription yet. The queue outlives this object. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, KeepsTopic keeps, SampleQueue& queue);
  ~DdsAdapter();

  /// Returns the topics to record that are new since the last call; the first call returns the project's. The
  /// caller opens each of them. One thread.
  std::vector<TopicInfo> new_topics();
  /// Subscribes to a topic, whose samples carry `number`. Returns false if DDS refuses, with the reason in
  /// `why`. One thread.
  bool open(const TopicInfo& topic, TopicNumber number, std::string& why);
  /// Ends all subscriptions. Samples in the queue stay.
  void close_all();

  /// Returns the counts of a topic's samples that have not reached the queue.
  TopicLosses losses(TopicNumber topic) const;
  WriterInfo describe(const Guid& writer) const;  ///< thread-safe
  /// Returns how many writers were announced of topics that are not recorded because there are too many.
  /// Thread-safe.
  std::uint64_t topics_left_out() const;
  void publish_status(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Finds the instance of a sample, for project types. Not thread-safe.
class InstanceFinder {
 public:
  InstanceFinder();
  ~InstanceFinder();
  /// Returns false if the type's key is not known or the bytes are not a valid sample.
  bool find(const std::string& type, std::span<const std::uint8_t> bytes, InstanceKey& instance);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Checks samples for events that are to be recorded. Not thread-safe.
class EventWatch {
 public:
  explicit EventWatch(const Triggers& triggers);
  ~EventWatch();
  /// Returns a description of the event if this sample reports one that is to be recorded, else none.
  std::optional<std::string> event_in(const TopicInfo& topic, std::span<const std::uint8_t> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Requests all recorders of the domain to write the samples that they hold in memory (operator_command
/// MARK). Waits at most `limit_s` for at least one recorder. Returns how many were reached. Throws DdsError.
std::uint32_t send_mark(const core::NetworkOptions& network, const std::string& issuer, double limit_s);

/// Returns those of the names, none of them a pattern, that no topic of the project has.
std::vector<std::string> unknown_names(const std::vector<std::string>& names);

}  // namespace phantom::dds_recorder
