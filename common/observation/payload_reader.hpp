#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/participant.hpp"
#include "common/diagnostics/graph.hpp"

namespace phantom::observation {

/// A topic whose type is known by name only.
struct PayloadTopic {
  std::string name;
  std::string type;
  bool keyed = false;  ///< must be as at the writers
};

/// What the reader asks for. The default is what disturbs a writer least: it waits for nobody's
/// acknowledgement and keeps nothing for late joiners.
struct PayloadQos {
  bool reliable = false;
  bool transient_local = false;  ///< with reliable: also what the writers keep for late joiners
  int depth = 256;               ///< samples that are kept until the listener took them; 0: all
  diagnostics::Liveliness liveliness = diagnostics::Liveliness::kAutomatic;
  std::int64_t lease_ns = diagnostics::kInfinite_ns;
  diagnostics::Ownership ownership = diagnostics::Ownership::kShared;
  std::string partition;  ///< hear this one only; empty: all
};

enum class InstanceState { kAlive, kDisposed, kNoWriters };

/// A sample as it came. With an instance state other than kAlive there may be no bytes.
struct Payload {
  std::span<const std::uint8_t> bytes;  ///< with the encapsulation header; valid during the call
  diagnostics::Guid writer{};
  std::uint64_t sequence_number = 0;  ///< of RTPS: rises by one for each write of this writer
  core::Nanoseconds source_ns = 0;    ///< UTC clock of the writer when it wrote; 0: not told
  core::Nanoseconds received_ns = 0;  ///< CLOCK_MONOTONIC of this host
  core::Nanoseconds received_utc_ns = 0;
  InstanceState instance = InstanceState::kAlive;
};

/// Calls come from a middleware thread, one at a time: copy and return; do not block or throw.
class PayloadListener {
 public:
  virtual ~PayloadListener() = default;
  virtual void on_payload(const Payload& payload) = 0;
  /// A writer proves that it lives again, or does not any more, by the kind and lease that the reader asked
  /// for.
  virtual void on_liveliness(const diagnostics::Guid& /*writer*/, bool /*alive*/) {}
};

/// Reads a topic of any type without knowing it: the serialized bytes, in all partitions (unless one is asked
/// for), in every representation. All instances count as one to the reader. Announces no type information.
class PayloadReader {
 public:
  /// Throws DdsError: in one participant a topic has one type.
  PayloadReader(dds::Participant& participant, const PayloadTopic& topic, const PayloadQos& qos,
                PayloadListener& listener);
  /// Returns when no call is in progress; none follows.
  ~PayloadReader();
  PayloadReader(const PayloadReader&) = delete;
  PayloadReader& operator=(const PayloadReader&) = delete;

  std::uint32_t matched() const;   ///< writers
  std::uint64_t rejected() const;  ///< samples that found the history full
  std::uint64_t lost() const;      ///< samples that the reader knows it will never get

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::observation
