#include "common/dds/refused_datagrams.hpp"

#include <spdlog/spdlog.h>

namespace phantom::dds {

std::vector<Refused> RefusedDatagrams::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<Refused> found;
  for (const Refused& one : by_fault_)
    if (one.count > 0) found.push_back(one);
  return found;
}

void RefusedDatagrams::log(const std::string& component, core::Nanoseconds now) {
  if (now < quiet_until_) return;
  for (const Refused& one : list()) {
    std::uint64_t& logged = logged_[static_cast<std::size_t>(one.fault)];
    if (one.count == logged) continue;
    spdlog::warn("{}: {} datagrams refused: {} ({} so far; the last from {})", component, one.count - logged,
                 wire::words_of(one.fault), one.count, to_text(one.last));
    logged = one.count;
    quiet_until_ = now + kEvery;
  }
}

std::string to_text(const wire::Source& source) {
  return fmt::format("{}.{}.{}.{}:{}", source.address >> 24, source.address >> 16 & 0xff,
                     source.address >> 8 & 0xff, source.address & 0xff, source.port);
}

}  // namespace phantom::dds
