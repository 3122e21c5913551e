#include "components/dds_spy/stream.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/elapsed.hpp"

namespace phantom::dds_spy {

Arrival Stream::take(const SampleFacts& sample) {
  const bool first = sums_.samples++ == 0;
  sums_.octets += sample.octets;
  sums_.least_octets = first ? sample.octets : std::min(sums_.least_octets, sample.octets);
  sums_.most_octets = std::max(sums_.most_octets, sample.octets);
  if (first) {
    first_ns_ = sample.received_ns;
  } else {
    const core::Nanoseconds period_ns = sample.received_ns - last_ns_;
    const double period_s = core::seconds(period_ns);
    const double count = static_cast<double>(sums_.samples - 1), before = sums_.period_mean_s;
    sums_.period_mean_s += (period_s - before) / count;
    period_variance_sum_ += (period_s - before) * (period_s - sums_.period_mean_s);
    sums_.period_min_s = count > 1 ? std::min(sums_.period_min_s, period_s) : period_s;
    sums_.period_max_s = std::max(sums_.period_max_s, period_s);
    periods_.record(period_ns);
  }
  last_ns_ = sample.received_ns;
  take_latency(sample);
  return compare_numbers(sample);
}

Arrival Stream::compare_numbers(const SampleFacts& sample) {
  Arrival arrival;
  const std::uint64_t expected = last_number_ + 1;
  if (last_number_ != 0 && sample.sequence_number < expected) {
    ++sums_.out_of_order;
    return arrival;
  }
  if (last_number_ != 0 && sample.sequence_number > expected) {
    arrival.missing = sample.sequence_number - expected;
    ++sums_.gaps;
    sums_.missing += arrival.missing;
    sums_.largest_gap = std::max(sums_.largest_gap, arrival.missing);
  }
  last_number_ = sample.sequence_number;
  if (sample.stamp && last_stamp_) {
    arrival.restarted = sample.stamp->session != last_stamp_->session;
    const auto next = last_stamp_->sequence_number + 1 + arrival.missing;
    if (!arrival.restarted && sample.stamp->sequence_number > next)
      arrival.skipped = sample.stamp->sequence_number - next;
    sums_.restarts += arrival.restarted ? 1 : 0;
    sums_.skipped += arrival.skipped;
  }
  if (sample.stamp) last_stamp_ = sample.stamp;
  return arrival;
}

void Stream::take_latency(const SampleFacts& sample) {
  core::Nanoseconds latency_ns = 0;
  if (sample.stamp && sample.same_host) {
    sums_.clock = LatencyClock::kMonotonic;
    latency_ns = core::elapsed_ns(sample.stamp->monotonic_ns, sample.received_ns);
  } else if (sample.stamp) {
    sums_.clock = LatencyClock::kStampUtc;
    latency_ns = core::elapsed_ns(sample.stamp->utc_ns, sample.received_utc_ns);
  } else if (sample.source_ns != 0) {
    sums_.clock = LatencyClock::kSourceTimestamp;
    latency_ns = core::elapsed_ns(sample.source_ns, sample.received_utc_ns);
  } else {
    return;
  }
  const bool first = sums_.latencies++ == 0;
  latency_min_ns_ = first ? latency_ns : std::min(latency_min_ns_, latency_ns);
  latency_max_ns_ = first ? latency_ns : std::max(latency_max_ns_, latency_ns);
  latency_sum_s_ += core::seconds(latency_ns);
  if (latency_ns < 0) ++sums_.negative_latencies;
  latencies_.record(std::max<core::Nanoseconds>(latency_ns, 0));
}

void Stream::take_number(std::uint64_t sequence_number) {
  last_number_ = std::max(last_number_, sequence_number);
}

void Stream::forget_sequence() {
  last_number_ = 0;
  last_stamp_.reset();
}

StreamFigures Stream::figures() const {
  StreamFigures figures = sums_;
  if (sums_.samples > 1) {
    const double periods = static_cast<double>(sums_.samples - 1);
    if (last_ns_ > first_ns_) figures.rate_hz = periods / core::seconds(last_ns_ - first_ns_);
    figures.jitter_s = std::sqrt(period_variance_sum_ / periods);
    figures.period_p99_s = core::seconds(periods_.quantile_ns(0.99));
  }
  if (sums_.latencies > 0) {
    figures.latency_min_s = core::seconds(latency_min_ns_);
    figures.latency_max_s = core::seconds(latency_max_ns_);
    figures.latency_mean_s = latency_sum_s_ / static_cast<double>(sums_.latencies);
    figures.latency_p50_s = core::seconds(latencies_.quantile_ns(0.5));
    figures.latency_p99_s = core::seconds(latencies_.quantile_ns(0.99));
  }
  return figures;
}

std::optional<DeadlineWatch::Miss> DeadlineWatch::take(core::Nanoseconds received_ns,
                                                       core::Nanoseconds made_ns) {
  std::optional<Miss> miss;
  const core::Nanoseconds pause_ns = received_ns - last_ns_;
  if (last_ns_ != 0 && pause_ns > period_ns_) {
    miss = Miss{static_cast<std::uint64_t>(pause_ns / period_ns_), pause_ns,
                made_ns != 0 && last_made_ns_ != 0 ? core::elapsed_ns(last_made_ns_, made_ns) : 0, reported_};
    missed_ += miss->periods;
  }
  last_ns_ = received_ns;
  last_made_ns_ = made_ns;
  reported_ = false;
  return miss;
}

std::optional<DeadlineWatch::Miss> DeadlineWatch::look(core::Nanoseconds now_ns) {
  const core::Nanoseconds pause_ns = now_ns - last_ns_;
  if (last_ns_ == 0 || reported_ || pause_ns <= period_ns_) return std::nullopt;
  reported_ = true;
  return Miss{static_cast<std::uint64_t>(pause_ns / period_ns_), pause_ns, 0, false};
}

}  // namespace phantom::dds_spy
