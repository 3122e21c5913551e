#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/clock.hpp"

namespace phantom::dds_recorder {

using Guid = std::array<std::uint8_t, 16>;
using TopicNumber = std::uint32_t;

/// A topic that is recorded. Its TopicNumber is its place in the list of topics.
struct TopicInfo {
  std::string name;
  std::string type;
  bool keyed = false;
  bool durable = false;         ///< late joiners get the newest sample of each instance
  std::string schema_encoding;  ///< "omgidl", "ros2msg"; empty: the type is not known here
  std::string schema;           ///< the type's description, with every type that it refers to
  std::vector<std::pair<std::string, std::string>> qos;  ///< policies as text, kept with the channel
};

/// A sample's metadata. Trivially copyable, because the queue copies it bytewise.
struct SampleHead {
  TopicNumber topic = 0;
  Guid writer{};
  std::uint64_t sequence_number = 0;  ///< rises by one for each sample of this writer
  core::Nanoseconds source_utc_ns = 0;
  core::Nanoseconds received_ns = 0;  ///< CLOCK_MONOTONIC of this host
};

/// A sample that does not own its bytes (encapsulation header and CDR).
struct SampleView {
  SampleHead head;
  std::span<const std::uint8_t> bytes;
};

/// A sample that owns its bytes.
struct Sample {
  SampleHead head;
  std::vector<std::uint8_t> bytes;
  SampleView view() const { return {head, bytes}; }
  /// Returns roughly the memory that it takes, in bytes.
  std::size_t cost() const { return sizeof *this + bytes.capacity() + 64; }
};

inline Sample owned(const SampleView& view) { return {view.head, {view.bytes.begin(), view.bytes.end()}}; }

}  // namespace phantom::dds_recorder
