#include "common/dds/arbitration/reader_quota.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace phantom::dds {

ReaderQuota::ReaderQuota(std::string component, std::string topic, std::size_t most,
                         std::shared_ptr<Bans> bans)
    : component_(std::move(component)), topic_(std::move(topic)), bans_(std::move(bans)), census_(most) {}

void ReaderQuota::note(const GuidPrefix& writer, const KeyQuota::Key& key) {
  const std::lock_guard lock(mutex_);
  const auto banned = census_.note(writer, key);
  if (!banned) return;
  spdlog::warn("{}: topic {}: a participant sends more keys than are kept; no more is taken from it",
               component_, topic_);
  bans_->ban(*banned);
}

void ReaderQuota::forget(const GuidPrefix& writer) {
  const std::lock_guard lock(mutex_);
  census_.forget(writer);
}

}  // namespace phantom::dds
