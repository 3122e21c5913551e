#pragma once

#include "common/core/clock.hpp"
#include "common/core/sample_id.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "phantom_idl/types.hpp"

namespace phantom::dds {

/// Makes the stamps of one writer: rising sequence numbers, both clocks, this process's session. Not
/// thread-safe.
class Stamper {
 public:
  explicit Stamper(const Participant& participant) : session_(participant.session()) {}
  msg::Stamp next();

 private:
  std::uint64_t session_;
  std::uint64_t sequence_number_ = 0;
};

/// Return the id of the sample that a stamp, or an echo of one, names. Real-time safe: yes.
core::SampleId id_of(const msg::Stamp& stamp) noexcept;
core::SampleId id_of(const msg::Echo& echo) noexcept;
/// Returns the echo to send back for a sample.
msg::Echo echo_of(const core::SampleId& id) noexcept;

/// Checks the order of one writer's samples by their numbers: accepts a sample if it is newer than the last
/// accepted, or from a new session of the writer. No number can lock it. A step that no writer makes is
/// refused, and a writer that continues from another number is accepted after kRun samples. If another
/// process might write the topic too, use SourceGuard. `accept` is real-time safe.
class SequenceGuard {
 public:
  /// Greatest accepted step from one sample to the next: at 1 kHz, an outage of a quarter of an hour.
  static constexpr std::uint64_t kMaxStep = 1'000'000;
  /// Number of refused samples in a row, each newer than the one before, after which their numbers are
  /// accepted.
  static constexpr int kRun = 8;

  bool accept(const msg::Stamp& stamp) noexcept;
  std::uint64_t lost() const noexcept { return lost_; }  ///< numbers that never arrived

 private:
  std::uint64_t session_ = 0, last_ = 0, lost_ = 0;
  std::uint64_t refused_ = 0;  // newest number refused since the last accepted sample
  int run_ = 0;
};

}  // namespace phantom::dds
