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

/// What of a topic did not reach the queue, so far.
struct InputLosses {
  std::uint64_t overflow = 0, dds_lost = 0, dds_rejected = 0;
};

/// Hears topics: the project's from the start, others as soon as one of their writers is discovered; every
/// sample goes into the queue as bytes. Announces itself and its state as every component does.
class DdsAdapter {
 public:
  using KeepsTopic = std::function<bool(const std::string&)>;
  /// Joins the data space; hears nothing yet. The queue outlives this. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, KeepsTopic keeps, SampleQueue& queue);
  ~DdsAdapter();

  /// Topics to record that are new since the last call; the first call gives the project's. Each must be
  /// opened. One thread.
  std::vector<TopicInfo> new_topics();
  /// Begins to hear a topic, whose samples will carry `number`. False if DDS refuses, with why. One thread.
  bool open(const TopicInfo& topic, TopicNumber number, std::string& why);
  /// Hears no more. What is in the queue stays.
  void close_all();

  InputLosses losses(TopicNumber topic) const;
  WriterInfo describe(const Guid& writer) const;  ///< thread-safe
  void publish_status(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The instance of a sample, for project types. Not thread-safe.
class InstanceFinder {
 public:
  InstanceFinder();
  ~InstanceFinder();
  /// False: the type's key is not known, or the bytes are no sample.
  bool find(const std::string& type, std::span<const std::uint8_t> bytes, InstanceKey& instance);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Looks into the samples that can be an event. Not thread-safe.
class EventWatch {
 public:
  explicit EventWatch(const Triggers& triggers);
  ~EventWatch();
  /// What happened, in words, if this sample tells of something that is to be kept.
  std::optional<std::string> event_in(const TopicInfo& topic, std::span<const std::uint8_t> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Asks all recorders of the domain to write what they hold of the time before (operator_command MARK). Waits
/// at most `limit_s` until one hears. Returns how many did. Throws DdsError.
std::uint32_t send_mark(const core::NetworkOptions& network, const std::string& issuer, double limit_s);

}  // namespace phantom::dds_recorder
