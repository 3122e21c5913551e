#pragma once

#include <functional>
#include <map>

#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

using InstanceKey = std::array<std::uint8_t, 16>;
/// Finds the instance of a sample of a keyed topic. Returns false if it is not known.
using InstanceOf = std::function<bool(TopicNumber, std::span<const std::uint8_t>, InstanceKey&)>;

/// Holds the newest sample of every instance of the durable topics: what a late joiner would get. Written at
/// the start of a file, it makes the file complete in itself. Where the instance is not known, every sample
/// counts as an instance. Bounded in memory: the oldest samples are forgotten. Not thread-safe.
class DurableState {
 public:
  DurableState(InstanceOf instance_of, std::size_t limit_bytes)
      : instance_of_(std::move(instance_of)), limit_bytes_(limit_bytes) {}

  void put(Sample sample, bool keyed);
  /// Calls visit(const Sample&) for each sample in the order of arrival.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [order, entry] : by_age_) visit(entry.sample);
  }
  std::size_t size() const { return by_age_.size(); }
  std::size_t bytes() const { return bytes_; }
  std::uint64_t forgotten() const { return forgotten_; }

 private:
  struct Name {
    TopicNumber topic = 0;
    InstanceKey instance{};
    Guid writer{};                      // only if the instance is not known
    std::uint64_t sequence_number = 0;  // likewise
    auto operator<=>(const Name&) const = default;
  };
  struct Entry {
    Name name;
    Sample sample;
  };
  void forget(std::map<std::uint64_t, Entry>::iterator entry);
  /// Returns the memory that it takes here, in bytes: its place in two maps besides.
  static std::size_t cost(const Sample& sample) { return sample.cost() + 2 * sizeof(Name) + 64; }

  InstanceOf instance_of_;
  std::size_t limit_bytes_, bytes_ = 0;
  std::uint64_t next_order_ = 0, forgotten_ = 0;
  std::map<std::uint64_t, Entry> by_age_;
  std::map<Name, std::uint64_t> orders_;
};

}  // namespace phantom::dds_recorder
