#include "common/layers/live_workspace.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "common/core/parallel.hpp"
#include "common/workspace/work_options.hpp"
#include "common/workspace/workspace_hash.hpp"

namespace phantom::layers {
namespace {

core::Status refusal(std::uint16_t id, const std::string& what) {
  return core::Status::invalid_argument("object " + std::to_string(id) + ": " + what);
}

core::Status check_version(std::uint64_t next, std::uint64_t present) {
  if (next > present) return core::Status::ok();
  return core::Status::invalid_argument("version " + std::to_string(next) + " does not rise above " +
                                        std::to_string(present));
}

void sort_unique(std::vector<workspace::BrickKey>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

void append(std::vector<workspace::BrickKey>& to, const std::vector<workspace::BrickKey>& keys) {
  to.insert(to.end(), keys.begin(), keys.end());
}

/// Adds some spare bricks, because an array that grows moves all of its content.
std::size_t with_room(std::size_t bricks) { return bricks + bricks / 8 + 64; }

constexpr std::size_t kBricksAtOnce = 64;  // merged before somebody is asked whether it goes on

bool goes_on(const ActivationOptions& options) { return !options.keep_going || options.keep_going(); }

/// Takes the hashes of those bricks that exist. Returns false if options.keep_going ended it.
bool hash_bricks(const workspace::Workspace& workspace, std::span<const workspace::BrickKey> keys,
                 std::span<std::uint64_t> hashes, const ActivationOptions& options) {
  for (std::size_t first = 0; first < keys.size(); first += kBricksAtOnce) {
    if (!goes_on(options)) return false;
    core::parallel_for(options.threads, std::min(kBricksAtOnce, keys.size() - first),
                       [&](std::size_t i, std::size_t) {
                         const workspace::BrickKey key = keys[first + i];
                         if (workspace.has_brick(key))
                           hashes[first + i] = workspace::brick_hash(key, workspace.brick(key));
                       });
  }
  return true;
}

/// Returns the options for one of several bodies; its progress is a part of the total.
ActivationOptions part_of(const ActivationOptions& whole, std::size_t index, std::size_t count) {
  ActivationOptions part = whole;
  if (whole.on_progress) {
    part.on_progress = [&whole, index, count](double share) {
      whole.on_progress((static_cast<double>(index) + share) / static_cast<double>(count));
    };
  }
  return part;
}

}  // namespace

/// An upper bound that looks at no brick.
std::uint64_t LiveWorkspace::steps_to_merge(const Objects& objects,
                                            std::span<const workspace::BrickKey> touched) {
  std::uint64_t held = 0;
  for (const auto& [id, object] : objects) held += std::min(object.bricks->keys().size(), touched.size());
  return merge_steps(touched.size(), objects.size(), held);
}

core::Expected<LiveWorkspace::Object> LiveWorkspace::activated(const Body& body,
                                                               const ActivationOptions& options,
                                                               WorkspaceChange& change) const {
  auto made = activate_object(body, workspace_.grid(), options);
  if (!made) return made.status();
  change.reports.push_back(std::move(made->report));
  return Object{std::make_shared<const workspace::ObjectBricks>(std::move(made->bricks)), body.profile, 0, 0};
}

core::Expected<WorkspaceChange> LiveWorkspace::add(std::span<const LiveBody> bodies, std::uint64_t version,
                                                   const ActivationOptions& options, const OnBody& on_body) {
  if (core::Status checked = check_version(version, workspace_.version); !checked) return checked;
  Objects next = objects_;
  std::vector<workspace::BrickKey> touched;
  WorkspaceChange change;
  std::int64_t latest = latest_;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = *bodies[i].body;
    if (body.id == 0 || body.id == 65535) return refusal(body.id, "no such id; allowed: 1 to 65534");
    if (next.contains(body.id)) return refusal(body.id, "is there already");
    auto object = activated(body, part_of(options, i, bodies.size()), change);
    if (!object) return object.status();
    object->priority = bodies[i].priority;
    object->latest = ++latest;
    append(touched, object->bricks->keys());
    next.emplace(body.id, *std::move(object));
    if (on_body) on_body(body, change.reports.back(), i + 1);
  }
  auto applied = apply(std::move(next), std::move(touched), std::move(change), version, options);
  if (applied) latest_ = latest;
  return applied;
}

core::Expected<WorkspaceChange> LiveWorkspace::move(const Body& body, std::uint64_t version,
                                                    const ActivationOptions& options) {
  if (core::Status checked = check_version(version, workspace_.version); !checked) return checked;
  const auto present = objects_.find(body.id);
  if (present == objects_.end()) return refusal(body.id, "is not there");
  WorkspaceChange change;
  auto object = activated(body, options, change);
  if (!object) return object.status();
  object->priority = present->second.priority;
  object->latest = latest_ + 1;
  std::vector<workspace::BrickKey> touched = present->second.bricks->keys();
  append(touched, object->bricks->keys());
  Objects next = objects_;
  next[body.id] = *std::move(object);
  auto applied = apply(std::move(next), std::move(touched), std::move(change), version, options);
  if (applied) ++latest_;
  return applied;
}

core::Expected<WorkspaceChange> LiveWorkspace::remove(std::uint16_t id, std::uint64_t version,
                                                      const ActivationOptions& options) {
  if (core::Status checked = check_version(version, workspace_.version); !checked) return checked;
  const auto present = objects_.find(id);
  if (present == objects_.end()) return refusal(id, "is not there");
  std::vector<workspace::BrickKey> touched = present->second.bricks->keys();
  Objects next = objects_;
  next.erase(id);
  return apply(std::move(next), std::move(touched), {}, version, options);
}

core::Expected<WorkspaceChange> LiveWorkspace::put(std::vector<ComputedObject> objects, std::uint64_t version,
                                                   const ActivationOptions& options) {
  if (core::Status checked = check_version(version, workspace_.version); !checked) return checked;
  Objects next = objects_;
  std::vector<workspace::BrickKey> touched;
  std::int64_t latest = latest_;
  for (ComputedObject& computed : objects) {
    if (computed.id == 0 || computed.id == 65535)
      return refusal(computed.id, "no such id; allowed: 1 to 65534");
    if (core::Status checked = workspace::check_profile(computed.profile); !checked)
      return refusal(computed.id, checked.message());
    const auto [entry, is_new] = next.try_emplace(computed.id);
    if (is_new) entry->second.latest = ++latest;
    entry->second.bricks = std::make_shared<const workspace::ObjectBricks>(std::move(computed.bricks));
    entry->second.profile = std::move(computed.profile);
    append(touched, computed.touched);
  }
  auto applied = apply(std::move(next), std::move(touched), {}, version, options);
  if (applied) latest_ = latest;
  return applied;
}

workspace::BitVolume LiveWorkspace::solid(const std::function<bool(std::uint16_t id)>& counts) const {
  const workspace::VoxelBox grid = workspace::VoxelBox::of(workspace_.grid());
  workspace::BitVolume solid(workspace_.grid().size_vox);
  for (const auto& [id, object] : objects_) {
    if (!counts(id)) continue;
    for (const workspace::BrickKey key : object.bricks->keys()) {
      const std::int8_t* const orders = object.bricks->orders(key);
      const workspace::VoxelBox box = workspace::box_of(key).intersection(grid);
      if (box.empty()) continue;
      const workspace::Index3 end = box.end();
      for (std::int32_t z = box.min.z; z < end.z; ++z) {
        for (std::int32_t y = box.min.y; y < end.y; ++y) {
          // A brick's row lies in one half of a word.
          std::uint64_t row = 0;
          for (std::int32_t x = box.min.x; x < end.x; ++x) {
            const std::int8_t order = orders[workspace::brick_offset({x, y, z})];
            row |= static_cast<std::uint64_t>((order >= workspace::kOrderBoundary) |
                                              (order < workspace::kOrderFree))
                   << (x & 63);
          }
          solid.row(y, z)[box.min.x >> 6] |= row;
        }
      }
    }
  }
  return solid;
}

core::Expected<WorkspaceChange> LiveWorkspace::renew(std::uint64_t version,
                                                     const ActivationOptions& options) {
  if (core::Status checked = check_version(version, workspace_.version); !checked) return checked;
  return apply(objects_, {}, {}, version, options);
}

core::Expected<WorkspaceChange> LiveWorkspace::apply(Objects next, std::vector<workspace::BrickKey> touched,
                                                     WorkspaceChange change, std::uint64_t version,
                                                     const ActivationOptions& options) {
  const auto now_s = [&options] { return options.stopwatch ? options.stopwatch() : 0.0; };
  const double from_s = now_s();
  std::vector<workspace::LayerProfile> profiles;
  for (const auto& [id, object] : next) profiles.push_back(object.profile);
  auto palette = workspace::next_palette(profiles, workspace_.palette());
  if (!palette) return palette.status();
  sort_unique(touched);
  change.version = version;
  change.codes_changed = !palette->keeps_codes;
  std::vector<workspace::BrickKey> merged = touched;
  if (change.codes_changed) {
    merged.clear();
    for (const auto& [id, object] : next) append(merged, object.bricks->keys());
    sort_unique(merged);
    touched = workspace_.bricks();
    append(touched, merged);
    sort_unique(touched);
  }
  const auto ended = [&options] {
    return workspace::ended_early({.budget = options.budget}, "merging its layers");
  };
  if (options.budget != nullptr && !options.budget->spend(steps_to_merge(next, touched))) return ended();
  std::optional<workspace::Workspace> recoded;
  std::vector<float> before = workspace_.palette();
  if (change.codes_changed) {
    recoded.emplace(workspace_.grid(), std::move(palette->mu_Pa_s_per_m));
    recoded->reserve_bricks(with_room(merged.size()));
  } else {
    reserve_for(touched);  // the last step that can fail
    workspace_.set_palette(std::move(palette->mu_Pa_s_per_m));
  }
  workspace::Workspace& into = recoded ? *recoded : workspace_;
  const std::size_t done = merge(next, merged, into, options);
  std::vector<std::uint64_t> hashes(touched.size());
  if (done < merged.size() || !hash_bricks(into, touched, hashes, options)) {
    // What was merged in place is merged again from the objects as they were.
    if (!recoded) {
      workspace_.set_palette(std::move(before));
      merge(objects_, std::span(merged).first(done), workspace_, {.threads = options.threads});
    }
    return ended();
  }
  if (recoded) {
    workspace_ = *std::move(recoded);
    reserved_bricks_ = with_room(merged.size());
  }
  objects_ = std::move(next);
  workspace_.version = version;
  change.merge_s = now_s() - from_s;
  take_hashes(touched, hashes, change);
  return change;
}

/// Merges the bricks, some at a time; returns how many before options.keep_going ended it.
std::size_t LiveWorkspace::merge(const Objects& objects, std::span<const workspace::BrickKey> keys,
                                 workspace::Workspace& workspace, const ActivationOptions& options) const {
  std::vector<workspace::CodeTable> codes;
  std::vector<MergeEntry> entries;
  codes.reserve(objects.size());  // entries point to them, so they must not move
  for (const auto& [id, object] : objects) {
    codes.push_back(workspace::code_table(object.profile, workspace.palette()));
    entries.push_back({object.bricks.get(), id, &codes.back(),
                       law_ == MergeLaw::kLatestObject ? object.latest : object.priority});
  }
  std::size_t done = 0;
  for (; done < keys.size() && goes_on(options); done += std::min(kBricksAtOnce, keys.size() - done))
    merge_bricks(law_, entries, keys.subspan(done, std::min(kBricksAtOnce, keys.size() - done)), workspace,
                 options.threads);
  return done;
}

/// Reserves room for the bricks of `keys` that do not exist yet.
void LiveWorkspace::reserve_for(std::span<const workspace::BrickKey> keys) {
  const auto is_new = [this](workspace::BrickKey key) { return !workspace_.has_brick(key); };
  const std::size_t count =
      workspace_.brick_count() + static_cast<std::size_t>(std::count_if(keys.begin(), keys.end(), is_new));
  if (count <= reserved_bricks_) return;
  workspace_.reserve_bricks(with_room(count));
  reserved_bricks_ = with_room(count);
}

void LiveWorkspace::take_hashes(std::span<const workspace::BrickKey> keys,
                                std::span<const std::uint64_t> hashes, WorkspaceChange& change) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const workspace::BrickKey key = keys[i];
    const auto before = hashes_.find(key);
    if (!workspace_.has_brick(key)) {
      if (before == hashes_.end()) continue;
      change.removed.push_back(key);
      hashes_.erase(before);
      continue;
    }
    if (before != hashes_.end() && before->second == hashes[i]) continue;
    change.changed.push_back(key);
    hashes_.insert_or_assign(key, hashes[i]);
  }
  content_hash_ = workspace::header_hash(workspace_.grid(), workspace_.palette());
  for (const auto& [key, hash] : hashes_) content_hash_ += hash;
}

std::size_t LiveWorkspace::object_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, object] : objects_) bytes += object.bricks->bytes();
  return bytes;
}

}  // namespace phantom::layers
