#include "common/wire/sample_assembly.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::wire {

SampleAssembly::SampleAssembly()
    : octets_(std::make_unique_for_overwrite<std::uint8_t[]>(kSamples * kMaxBytes)) {}

std::size_t SampleAssembly::place_of(const FragmentFact& fragment, core::Nanoseconds now) {
  std::size_t oldest = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (samples_[i].sequence == fragment.sequence && samples_[i].writer == fragment.writer) return i;
    if (samples_[i].sequence == 0 ||
        (samples_[oldest].sequence != 0 && samples_[i].last < samples_[oldest].last))
      oldest = i;
  }
  Sample& sample = samples_[oldest] = {};
  sample.writer = fragment.writer;
  sample.sequence = fragment.sequence;
  sample.sample_bytes = fragment.sample_bytes;
  sample.fragment_bytes = fragment.fragment_bytes;
  sample.missing = (fragment.sample_bytes + fragment.fragment_bytes - 1u) / fragment.fragment_bytes;
  sample.last = now;
  return oldest;
}

std::span<std::uint8_t> SampleAssembly::add(std::span<const std::uint8_t> datagram,
                                            const FragmentFact& fragment, core::Nanoseconds now,
                                            bool& refused) {
  refused = fragment.sample_bytes > kMaxBytes ||
            fragment.sample_bytes > kMaxFragments * std::size_t{fragment.fragment_bytes};
  if (refused) return {};
  const std::size_t place = place_of(fragment, now);
  Sample& sample = samples_[place];
  refused = sample.sample_bytes != fragment.sample_bytes || sample.fragment_bytes != fragment.fragment_bytes;
  if (refused) return {};
  sample.last = now;
  const std::span<std::uint8_t> whole(octets_.get() + place * kMaxBytes, sample.sample_bytes);
  const std::size_t from = std::size_t{fragment.first - 1} * fragment.fragment_bytes;
  std::memcpy(whole.data() + from, datagram.data() + fragment.at, fragment.size);
  for (std::size_t i = fragment.first - 1; i < fragment.first - 1 + fragment.count; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << (i % 64);
    if ((sample.have[i / 64] & bit) == 0) --sample.missing;
    sample.have[i / 64] |= bit;
  }
  if (sample.missing > 0) return {};
  sample.sequence = 0;
  return whole;
}

}  // namespace phantom::wire
