#pragma once

#include <cstdint>
#include <optional>

#include "common/core/clock.hpp"
#include "common/core/histogram.hpp"

namespace phantom::dds_spy {

/// A sample's own stamp (idl/types.idl).
struct SampleStamp {
  std::uint64_t sequence_number = 0;
  core::Nanoseconds monotonic_ns = 0;
  core::Nanoseconds utc_ns = 0;
  std::uint64_t session = 0;
};

/// A sample's metadata.
struct SampleFacts {
  core::Nanoseconds received_ns = 0;      ///< CLOCK_MONOTONIC of this host
  core::Nanoseconds received_utc_ns = 0;  ///< CLOCK_REALTIME of this host
  core::Nanoseconds source_ns = 0;        ///< CLOCK_REALTIME of the writer's host at the write; 0: not sent
  std::uint64_t sequence_number = 0;      ///< RTPS number; rises by one with each write of the writer
  std::size_t octets = 0;
  std::optional<SampleStamp> stamp;
  bool same_host = false;  ///< the writer shares this host's CLOCK_MONOTONIC
};

/// The clocks that a latency compares, the best first.
enum class LatencyClock {
  kNone,             ///< nothing to compare
  kMonotonic,        ///< the same clock: CLOCK_MONOTONIC of this host, in the stamp and here
  kStampUtc,         ///< UTC clocks of two hosts, from the stamp: wrong by their difference
  kSourceTimestamp,  ///< likewise, from the DDS source timestamp
};

struct StreamFigures {
  std::uint64_t samples = 0, octets = 0;
  std::size_t least_octets = 0, most_octets = 0;
  double rate_hz = 0.0;  ///< number of periods ÷ time from the first sample to the last; 0 below two samples
  // Time between arrivals; 0 below two samples. Jitter is its standard deviation.
  double period_mean_s = 0.0, period_min_s = 0.0, period_max_s = 0.0, period_p99_s = 0.0, jitter_s = 0.0;
  std::uint64_t gaps = 0, missing = 0, largest_gap = 0;  ///< samples written but not received
  std::uint64_t out_of_order = 0;  ///< samples with a number at or below an earlier one's
  std::uint64_t skipped = 0;       ///< stamp numbers that the writer itself left out
  std::uint64_t restarts = 0;      ///< new sessions in the stamps
  LatencyClock clock = LatencyClock::kNone;
  std::uint64_t latencies = 0, negative_latencies = 0;
  double latency_min_s = 0.0, latency_mean_s = 0.0, latency_p50_s = 0.0, latency_p99_s = 0.0,
         latency_max_s = 0.0;
};

/// What taking a sample has revealed, for events.
struct Arrival {
  std::uint64_t missing = 0;  ///< samples lost just before this one
  std::uint64_t skipped = 0;  ///< stamp numbers that the writer left out
  bool restarted = false;     ///< its stamp has another session than the last one
};

/// Measures one writer's samples: rate, regularity, losses and age. Not thread-safe.
class Stream {
 public:
  Arrival take(const SampleFacts& sample);
  /// Counts the number of a write without a sample (its instance is gone).
  void take_number(std::uint64_t sequence_number);
  /// Skips the comparison for the next sample's number, because a new reader may have missed some.
  void forget_sequence();
  StreamFigures figures() const;

 private:
  Arrival compare_numbers(const SampleFacts& sample);
  void take_latency(const SampleFacts& sample);

  StreamFigures sums_;
  core::Nanoseconds first_ns_ = 0, last_ns_ = 0;
  double period_variance_sum_ = 0.0;  // Welford's algorithm
  core::DurationHistogram periods_, latencies_;
  core::Nanoseconds latency_min_ns_ = 0, latency_max_ns_ = 0;
  double latency_sum_s_ = 0.0;
  std::uint64_t last_number_ = 0;
  std::optional<SampleStamp> last_stamp_;
};

/// Checks one writer's (or instance's) samples against the deadline that the writer offers.
class DeadlineWatch {
 public:
  struct Miss {
    std::uint64_t periods = 0;  ///< deadlines that passed without a sample
    core::Nanoseconds pause_ns = 0;
    core::Nanoseconds made_apart_ns = 0;  ///< difference of the two samples' own times; 0: not known
    bool reported = false;                ///< look() has returned its beginning
  };

  explicit DeadlineWatch(core::Nanoseconds period_ns) : period_ns_(period_ns) {}
  /// Takes a sample; `made_ns` is when it was made by its writer's clock (0: not known). Returns the miss
  /// that it ends.
  std::optional<Miss> take(core::Nanoseconds received_ns, core::Nanoseconds made_ns);
  /// Returns a miss that has begun and was not returned yet.
  std::optional<Miss> look(core::Nanoseconds now_ns);
  std::uint64_t missed() const { return missed_; }
  core::Nanoseconds period_ns() const { return period_ns_; }

 private:
  core::Nanoseconds period_ns_, last_ns_ = 0, last_made_ns_ = 0;
  std::uint64_t missed_ = 0;
  bool reported_ = false;
};

}  // namespace phantom::dds_spy
