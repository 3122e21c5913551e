#include "common/messages/object_sources.hpp"

#include <algorithm>
#include <utility>

namespace phantom::messages {
namespace {

bool same(const WorkspaceObject& a, const WorkspaceObject& b) {
  return a.name == b.name && a.mesh_hash == b.mesh_hash && a.colour == b.colour &&
         a.X_WO.rotation == b.X_WO.rotation && a.X_WO.translation_m == b.X_WO.translation_m;
}

/// Returns what turns one set of objects into another.
std::vector<WorkspaceObject> difference(const ObjectSources::Objects& from,
                                        const ObjectSources::Objects& to) {
  std::vector<WorkspaceObject> changes;
  for (const auto& [id, object] : from) {
    if (!to.contains(id)) changes.push_back({.id = id});
  }
  for (const auto& [id, object] : to) {
    const auto before = from.find(id);
    if (before == from.end() || !same(before->second, object)) changes.push_back(object);
  }
  return changes;
}

}  // namespace

ObjectSources::Source* ObjectSources::find_or_add(const workspace::SourceId& server) {
  auto found = std::find_if(sources_.begin(), sources_.end(),
                            [&](const Source& source) { return source.server == server; });
  if (found == sources_.end()) {
    if (sources_.size() >= kMax) return nullptr;
    found = sources_.insert(sources_.end(), Source{.server = server});
  }
  found->gone = false;
  return &*found;
}

ObjectSources::Taken ObjectSources::take(const workspace::SourceId& server, const WorkspaceObject& object) {
  Source* source = find_or_add(server);
  if (source == nullptr) return {};
  const bool is_in_force = source == &sources_.front();
  if (object.removed()) {
    source->objects.erase(object.id);
  } else {
    const std::size_t most = std::max(kMinObjects, 2 * sources_.front().objects.size());
    const bool is_new = !source->objects.contains(object.id);
    if (!is_in_force && is_new && source->objects.size() >= most) return {};
    source->objects.insert_or_assign(object.id, object);
  }
  if (is_in_force) return {true, {object}};
  return {true, choose()};
}

ObjectSources::Taken ObjectSources::commit(const workspace::SourceId& server, WorkspaceVersion version) {
  Source* source = find_or_add(server);
  if (source == nullptr) return {};
  source->version = std::move(version);
  std::vector<WorkspaceObject> changes = choose();
  return {sources_.front().server == server, std::move(changes)};
}

std::vector<WorkspaceObject> ObjectSources::gone(const workspace::SourceId& server) {
  const auto found = std::find_if(sources_.begin(), sources_.end(),
                                  [&](const Source& source) { return source.server == server; });
  if (found == sources_.end()) return {};
  found->gone = true;
  if (found != sources_.begin()) sources_.erase(found);
  return choose();
}

/// Puts another server in force if there is one that may be and it is needed.
std::vector<WorkspaceObject> ObjectSources::choose() {
  if (sources_.empty() || (sources_.front().version && !sources_.front().gone)) return {};
  const auto successor = std::find_if(sources_.begin(), sources_.end(),
                                      [](const Source& source) { return !source.gone && source.version; });
  if (successor == sources_.end() || successor == sources_.begin()) return {};
  std::vector<WorkspaceObject> changes = difference(sources_.front().objects, successor->objects);
  std::iter_swap(sources_.begin(), successor);
  sources_.erase(successor);
  return changes;
}

const std::optional<WorkspaceVersion>& ObjectSources::version() const {
  static const std::optional<WorkspaceVersion> none;
  return sources_.empty() ? none : sources_.front().version;
}

const std::vector<CarriedObject>& ObjectSources::carried() const {
  static const std::vector<CarriedObject> none;
  return version() ? version()->carried : none;
}

std::optional<workspace::SourceId> ObjectSources::server() const {
  return version() ? std::optional(sources_.front().server) : std::nullopt;
}

const ObjectSources::Objects& ObjectSources::in_force() const {
  static const Objects none;
  return sources_.empty() ? none : sources_.front().objects;
}

const ObjectSources::Objects& ObjectSources::of(const workspace::SourceId& server) const {
  const auto found = std::find_if(sources_.begin(), sources_.end(),
                                  [&](const Source& source) { return source.server == server; });
  return found != sources_.end() ? found->objects : in_force();
}

}  // namespace phantom::messages
