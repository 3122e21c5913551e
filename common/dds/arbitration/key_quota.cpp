#include "common/dds/arbitration/key_quota.hpp"

#include <algorithm>

namespace phantom::dds {

std::size_t KeyQuota::Hash::operator()(const Key& key) const noexcept {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const std::uint8_t octet : key) hash = (hash ^ octet) * 0x100000001b3;
  return static_cast<std::size_t>(hash);
}

std::optional<GuidPrefix> KeyQuota::note(const GuidPrefix& writer, const Key& key) {
  if (!keys_.try_emplace(key, writer).second) return std::nullopt;
  const auto [bringer, is_new] = bringers_.try_emplace(writer);
  if (is_new) bringer->second.order = next_order_++;
  ++bringer->second.keys;
  if (keys_.size() <= most_) return std::nullopt;
  const GuidPrefix gone = select_eviction();
  forget(gone);
  return gone;
}

GuidPrefix KeyQuota::select_eviction() const {
  const auto most = std::max_element(bringers_.begin(), bringers_.end(), [](const auto& a, const auto& b) {
    return a.second.keys < b.second.keys;
  });
  auto last = bringers_.end();
  for (auto one = bringers_.begin(); one != bringers_.end(); ++one) {
    if (8 * one->second.keys < keys_.size()) continue;
    if (last == bringers_.end() || one->second.order > last->second.order) last = one;
  }
  return last != bringers_.end() ? last->first : most->first;
}

void KeyQuota::forget(const GuidPrefix& writer) {
  if (bringers_.erase(writer) == 0) return;
  std::erase_if(keys_, [&](const auto& one) { return one.second == writer; });
}

}  // namespace phantom::dds
