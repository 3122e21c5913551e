#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/diagnostics/graph.hpp"

namespace phantom::observation {

/// A topic of which only the name of the type is known.
struct PayloadTopic {
  std::string name;
  std::string type;
  bool keyed = false;  ///< must equal the writers' setting
};

enum class InstanceState { kAlive, kDisposed, kNoWriters };

/// A sample as received. If the instance state is not kAlive, there may be no bytes.
struct Payload {
  std::span<const std::uint8_t> bytes;  ///< with the encapsulation header; valid during the call
  diagnostics::Guid writer{};
  std::uint64_t sequence_number = 0;  ///< of RTPS: rises by one with each write of this writer
  core::Nanoseconds source_ns = 0;    ///< UTC clock of the writer when it wrote; 0: not sent
  core::Nanoseconds received_ns = 0;  ///< CLOCK_MONOTONIC of this host
  core::Nanoseconds received_utc_ns = 0;
  InstanceState instance = InstanceState::kAlive;
};

/// Receives samples. Calls come from a middleware thread, one at a time: copy and return; do not block or
/// throw.
class PayloadListener {
 public:
  virtual ~PayloadListener() = default;
  virtual void on_payload(const Payload& payload) = 0;
  /// Reports that a writer's liveliness was lost or regained, by the kind and lease that the reader
  /// requested.
  virtual void on_liveliness(const diagnostics::Guid& /*writer*/, bool /*alive*/) {}
};

/// Reads a topic of any type without knowing the type: the serialised bytes, in every data representation.
/// The reader treats all instances as one, unless a sample says to which it belongs. Announces no type
/// information.
///
/// Nobody can make it grow: of a keyed topic it takes note of the keys, and bans the participant that brings
/// too many, as the project's own readers do (dds::ReaderQuota): three quarters of the instances that these
/// may have, or of kMinInstances if that is more, because an observer may see several cells at once.
class PayloadReader {
 public:
  static constexpr std::size_t kMinInstances = 8192;       ///< of a topic of the project, at least
  static constexpr std::size_t kForeignInstances = 65536;  ///< of any other topic

  /// Requests `qos`. By default it disturbs a writer least: the writer waits for no acknowledgement and keeps
  /// nothing for late joiners. Without partitions it reads all of them. `depth`: samples kept until the
  /// listener has taken them; 0: all. Throws DdsError, also if the participant knows the topic with another
  /// type: in one participant a topic has one type.
  PayloadReader(dds::Participant& participant, const PayloadTopic& topic, const diagnostics::EndpointQos& qos,
                PayloadListener& listener, int depth = 256);
  /// Waits for a call in progress; no call follows.
  ~PayloadReader();
  PayloadReader(const PayloadReader&) = delete;
  PayloadReader& operator=(const PayloadReader&) = delete;

  std::uint32_t matched() const;   ///< number of matched writers
  std::uint64_t rejected() const;  ///< samples rejected because the history was full
  std::uint64_t lost() const;      ///< samples that the reader knows it will never receive

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::observation
