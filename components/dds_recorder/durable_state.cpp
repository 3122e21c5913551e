#include "components/dds_recorder/durable_state.hpp"

namespace phantom::dds_recorder {

void DurableState::put(Sample sample, bool keyed) {
  Name name{.topic = sample.head.topic};
  if (keyed && !instance_of_(name.topic, sample.bytes, name.instance)) {
    name.writer = sample.head.writer;
    name.sequence_number = sample.head.sequence_number;
  }
  if (const auto known = orders_.find(name); known != orders_.end()) forget(by_age_.find(known->second));
  bytes_ += cost(sample);
  orders_[name] = next_order_;
  by_age_.emplace(next_order_++, Entry{name, std::move(sample)});
  while (bytes_ > limit_bytes_ && by_age_.size() > 1) {
    forget(by_age_.begin());
    ++forgotten_;
  }
}

void DurableState::forget(std::map<std::uint64_t, Entry>::iterator entry) {
  bytes_ -= cost(entry->second.sample);
  orders_.erase(entry->second.name);
  by_age_.erase(entry);
}

}  // namespace phantom::dds_recorder
