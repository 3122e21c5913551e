#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "common/core/clock.hpp"
#include "common/dds/participant.hpp"
#include "common/diagnostics/qos.hpp"
#include "common/observation/payload_reader.hpp"

namespace phantom::observation {

/// Writes samples that are serialized already on a topic of any type. Announces no type information.
/// Thread-safe.
class PayloadWriter {
 public:
  /// The instance that a sample belongs to, from its bytes; needed for keyed topics. False: the bytes are no
  /// sample.
  using InstanceOf = std::function<bool(std::span<const std::uint8_t>, std::array<std::uint8_t, 16>&)>;

  /// Offers `qos`; keeps the last `depth` samples of each instance. Throws DdsError: in one participant a
  /// topic has one type; a keyed topic needs `instance_of`.
  PayloadWriter(dds::Participant& participant, const PayloadTopic& topic, const diagnostics::EndpointQos& qos,
                int depth, InstanceOf instance_of = {});
  ~PayloadWriter();
  PayloadWriter(const PayloadWriter&) = delete;
  PayloadWriter& operator=(const PayloadWriter&) = delete;

  /// `bytes` with the encapsulation header. May block for tens of milliseconds while a reader joins. False if
  /// the sample could not be queued or is none.
  bool write(std::span<const std::uint8_t> bytes);
  /// Waits until every reliable reader has what was written, `longest_ns` at most. False: one has not.
  bool wait_until_received(core::Nanoseconds longest_ns);
  std::uint32_t matched() const;  ///< readers

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::observation
