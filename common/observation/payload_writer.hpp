#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/diagnostics/qos.hpp"
#include "common/observation/payload_reader.hpp"

namespace phantom::observation {

/// Writes samples that are already serialised, on a topic of any type. Announces no type information.
/// Thread-safe.
class PayloadWriter {
 public:
  /// Finds the instance that a sample belongs to, from its bytes; needed for keyed topics. Returns false if
  /// the bytes are not a sample.
  using InstanceOf = std::function<bool(std::span<const std::uint8_t>, std::array<std::uint8_t, 16>&)>;

  /// Offers `qos`; keeps the last `depth` samples of each instance. Throws DdsError, also if the participant
  /// knows the topic with another type (in one participant a topic has one type), or if a keyed topic comes
  /// without `instance_of`.
  PayloadWriter(dds::Participant& participant, const PayloadTopic& topic, const diagnostics::EndpointQos& qos,
                int depth, InstanceOf instance_of = {});
  ~PayloadWriter();
  PayloadWriter(const PayloadWriter&) = delete;
  PayloadWriter& operator=(const PayloadWriter&) = delete;

  /// Writes `bytes`, which begin with the encapsulation header. May block for tens of milliseconds while a
  /// reader joins. Returns false if the sample could not be queued or is invalid.
  bool write(std::span<const std::uint8_t> bytes);
  /// Waits until every reliable reader has received what was written, for `longest_ns` at most. Returns false
  /// if one has not.
  bool wait_until_received(core::Nanoseconds longest_ns);
  std::uint32_t matched() const;  ///< number of matched readers

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::observation
