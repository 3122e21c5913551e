#include "common/dds/admission/refused_datagrams.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace phantom::dds {

void SenderCounts::add(std::uint32_t address) {
  const auto known = std::find_if(places_.begin(), places_.end(), [&](const Place& place) {
    return place.count > 0 && place.address == address;
  });
  if (known != places_.end()) {
    ++known->count;
    return;
  }
  Place& least = *std::min_element(places_.begin(), places_.end(),
                                   [](const Place& a, const Place& b) { return a.count < b.count; });
  least = {address, least.count + 1, least.count};
}

Sender SenderCounts::greatest() const {
  const auto own = [](const Place& place) { return place.count - place.inherited; };
  const Place& most = *std::max_element(places_.begin(), places_.end(),
                                        [&](const Place& a, const Place& b) { return own(a) < own(b); });
  return {most.address, own(most)};
}

std::vector<Refused> RefusedDatagrams::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<Refused> found;
  for (std::size_t i = 0; i < by_fault_.size(); ++i) {
    const Count& one = by_fault_[i];
    if (one.count > 0)
      found.push_back({static_cast<wire::Fault>(i), one.count, one.last, one.senders.greatest()});
  }
  return found;
}

void RefusedDatagrams::log(const std::string& component, core::Nanoseconds now) {
  if (now < quiet_until_) return;
  for (const Refused& one : list()) {
    std::uint64_t& logged = logged_[static_cast<std::size_t>(one.fault)];
    if (one.count == logged) continue;
    spdlog::warn("{}: {} datagrams refused: {} ({} so far, {} of them from {}; the last from {})", component,
                 one.count - logged, wire::words_of(one.fault), one.count, one.greatest.count,
                 address_text(one.greatest.address), to_text(one.last));
    logged = one.count;
    quiet_until_ = now + kEvery;
  }
}

std::string address_text(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24, address >> 16 & 0xff, address >> 8 & 0xff, address & 0xff);
}

std::string to_text(const wire::Source& source) {
  return fmt::format("{}:{}", address_text(source.address), source.port);
}

}  // namespace phantom::dds
