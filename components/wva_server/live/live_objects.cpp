#include "components/wva_server/live/live_objects.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <tuple>

#include "common/core/printable.hpp"
#include "common/core/text.hpp"

namespace phantom::wva_server {
namespace {

constexpr std::size_t kMaxRatio = 4;  // of the voxels of a thing in two sights

/// A part that may be an object, better if less. Ids and places make the order total.
struct Candidate {
  double cost = 0.0;
  std::uint16_t id = 0;
  std::size_t part = 0;
  auto key() const { return std::tuple(cost, id, part); }
  friend bool operator<(const Candidate& a, const Candidate& b) { return a.key() < b.key(); }
};

bool may_follow(const TrackedObject& object) { return !object.is_fixed(); }

core::Status refused(const std::string& why) { return core::Status::invalid_argument(why); }

}  // namespace

LiveObjects::LiveObjects(double voxel_m) : voxel_m_(voxel_m) {
  for (std::uint16_t id = messages::kFirstLiveObjectId; id < messages::kLiveId; ++id) free_ids_.push_back(id);
}

void LiveObjects::forget(std::uint16_t id) {
  objects_.erase(id);
  free_ids_.push_back(id);
}

/// Returns an id for a new object, if need be that of the one that was lost first; 0: none is left.
std::uint16_t LiveObjects::new_id(core::Nanoseconds now_ns) {
  if (free_ids_.empty()) {
    std::uint16_t oldest = 0;
    for (const auto& [id, object] : objects_)
      if (object.standing == LiveStanding::kLost && object.seen_ns < now_ns &&
          (oldest == 0 || object.seen_ns < objects_.at(oldest).seen_ns))
        oldest = id;
    if (oldest == 0) return 0;
    forget(oldest);
  }
  const std::uint16_t id = free_ids_.front();
  free_ids_.pop_front();
  return id;
}

LivePart LiveObjects::follow(std::vector<LivePart> parts, core::Nanoseconds now_ns) {
  std::vector<Candidate> by_overlap, by_distance;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (const auto& [id, object] : objects_) {
      if (!may_follow(object)) continue;
      if (const std::size_t shared = shared_voxels(parts[i], object.part); shared > 0)
        by_overlap.push_back({-static_cast<double>(shared), id, i});
      const double distance_m = voxel_m_ * (parts[i].middle_vox() - object.part.middle_vox()).norm();
      const auto [less, more] = std::minmax(parts[i].voxels, object.part.voxels);
      if (distance_m <= kMaxStep_m && more <= kMaxRatio * less) by_distance.push_back({distance_m, id, i});
    }
  }
  std::vector<bool> taken(parts.size());
  std::map<std::uint16_t, std::size_t> part_of_id;
  for (auto* candidates : {&by_overlap, &by_distance}) {
    std::sort(candidates->begin(), candidates->end());
    for (const Candidate& candidate : *candidates) {
      if (taken[candidate.part] || part_of_id.contains(candidate.id)) continue;
      taken[candidate.part] = true;
      part_of_id.emplace(candidate.id, candidate.part);
    }
  }
  for (auto& [id, object] : objects_) {
    if (!may_follow(object)) continue;
    const auto part = part_of_id.find(id);
    const bool is_seen = part != part_of_id.end();
    if (is_seen || object.standing == LiveStanding::kTracked) object.seen_ns = now_ns;
    object.standing = is_seen ? LiveStanding::kTracked : LiveStanding::kLost;
    if (is_seen) object.part = std::move(parts[part->second]);
  }
  // The largest of the others get the ids that are left.
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (!taken[i]) others.push_back(i);
  std::stable_sort(others.begin(), others.end(),
                   [&](std::size_t a, std::size_t b) { return parts[a].voxels > parts[b].voxels; });
  LivePart rest;
  for (const std::size_t i : others) {
    if (const std::uint16_t id = new_id(now_ns); id != 0) {
      objects_[id] = {messages::live_name(id), LiveStanding::kTracked, std::move(parts[i]), now_ns};
    } else {
      unite(rest, parts[i]);
    }
  }
  return rest;
}

bool LiveObjects::expire(core::Nanoseconds now_ns) {
  bool discarded = false;
  std::vector<std::uint16_t> ended;
  for (const auto& [id, object] : objects_) {
    if (object.is_there()) continue;
    const bool is_discarded = object.standing == LiveStanding::kDiscarded;
    if (core::seconds(now_ns - object.seen_ns) <= (is_discarded ? kForgotten_s : kLost_s)) continue;
    discarded = discarded || is_discarded;
    ended.push_back(id);
  }
  for (const std::uint16_t id : ended) forget(id);
  return discarded;
}

std::uint16_t LiveObjects::find(const std::string& name) const {
  const auto found =
      std::ranges::find_if(objects_, [&](const auto& entry) { return entry.second.name == name; });
  return found == objects_.end() ? 0 : found->first;
}

core::Expected<TrackedObject*> LiveObjects::look_up(std::uint16_t id) {
  const auto found = objects_.find(id);
  if (found != objects_.end()) return &found->second;
  if (id == messages::kLiveId)
    return refused(fmt::format("'{}' is what no id was left for; allowed: one of the {} objects with an id",
                               messages::kLiveName, messages::kMaxLiveObjects));
  return core::Status::not_found(
      fmt::format("cameras see no '{}'; they see: {}", messages::live_name(id),
                  core::listed(objects_, [](const auto& entry) { return entry.second.name; })));
}

core::Status LiveObjects::freeze(std::uint16_t id) {
  const auto found = look_up(id);
  if (!found) return found.status();
  TrackedObject& object = **found;
  if (object.standing == LiveStanding::kFrozen) return refused("'" + object.name + "' is frozen already");
  if (object.standing == LiveStanding::kDiscarded)
    return refused("'" + object.name + "' is discarded; allowed: to restore it first");
  if (object.standing != LiveStanding::kTracked)
    return refused("'" + object.name + "' is not there; allowed: what cameras see now");
  object.standing = LiveStanding::kFrozen;
  return core::Status::ok();
}

core::Status LiveObjects::discard(std::uint16_t id, core::Nanoseconds now_ns) {
  const auto found = look_up(id);
  if (!found) return found.status();
  TrackedObject& object = **found;
  if (object.standing == LiveStanding::kDiscarded)
    return refused("'" + object.name + "' is discarded already");
  if (!object.is_there()) return refused("'" + object.name + "' is not there; allowed: what is felt now");
  object.standing = LiveStanding::kDiscarded;
  object.seen_ns = now_ns;
  return core::Status::ok();
}

core::Status LiveObjects::restore(std::uint16_t id, core::Nanoseconds now_ns) {
  const auto found = look_up(id);
  if (!found) return found.status();
  TrackedObject& object = **found;
  if (!object.is_fixed())
    return refused("'" + object.name + "' is neither frozen nor discarded; allowed: one that is");
  object.standing = LiveStanding::kLost;
  object.seen_ns = now_ns;
  return core::Status::ok();
}

core::Status LiveObjects::rename(std::uint16_t id, const std::string& name) {
  const auto found = look_up(id);
  if (!found) return found.status();
  if (name.empty() || !core::is_printable(name))
    return refused(
        fmt::format("'{}' is no name; allowed: one line of printable characters", core::printable(name)));
  if (const std::uint16_t other = find(name); other != 0 && other != id)
    return refused(fmt::format("another thing that cameras see is called '{}'", name));
  if (messages::is_live_name(name) && name != messages::live_name(id))
    return refused(
        fmt::format("'{}' is a name that things get which cameras see; give it another one", name));
  (*found)->name = name;
  return core::Status::ok();
}

}  // namespace phantom::wva_server
