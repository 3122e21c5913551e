#include "components/phantom_sensing/workspace/secondary_workspace.hpp"

#include <set>

namespace phantom::phantom_sensing {
namespace {

// The same command gives both the same numbers; poses of two cell files differ by rounding.
constexpr double kSame = 1e-6;  // m, and of the rotations' entries

const messages::WorkspaceObject* find(const SecondaryWorkspace::Objects& objects, std::uint16_t id) {
  const auto found = objects.find(id);
  return found == objects.end() ? nullptr : &found->second;
}

bool alike(const messages::WorkspaceObject* a, const messages::WorkspaceObject* b) {
  if (a == nullptr || b == nullptr) return a == b;
  return a->name == b->name && (a->X_WO.translation_m - b->X_WO.translation_m).norm() < kSame &&
         (a->X_WO.rotation - b->X_WO.rotation).cwiseAbs().maxCoeff() < kSame;
}

}  // namespace

SecondaryWorkspace::Objects SecondaryWorkspace::with_carried(
    Objects objects, const std::vector<messages::CarriedObject>& carried) {
  for (const messages::CarriedObject& one : carried) {
    const auto found = objects.find(one.id);
    if (found == objects.end()) continue;
    found->second.name += " (carried by '" + one.arm + "' at '" + one.frame + "')";
    found->second.X_WO = one.X_FO;
  }
  return objects;
}

std::vector<std::string> SecondaryWorkspace::compare(const Objects& here, const Objects& there,
                                                     core::Nanoseconds now_ns) {
  std::vector<std::string> names;
  std::set<std::uint16_t> ids;
  if (!here.empty() && !there.empty())
    for (const Objects* objects : {&here, &there})
      for (const auto& [id, object] : *objects) ids.insert(id);
  std::erase_if(since_ns_, [&](const auto& known) { return !ids.contains(known.first); });
  for (const std::uint16_t id : ids) {
    const messages::WorkspaceObject *one = find(here, id), *other = find(there, id);
    if (alike(one, other)) {
      since_ns_.erase(id);
      continue;
    }
    const core::Nanoseconds since_ns = since_ns_.try_emplace(id, now_ns).first->second;
    if (now_ns - since_ns >= kReportedAfter_ns) names.push_back((one != nullptr ? one : other)->name);
  }
  return names;
}

}  // namespace phantom::phantom_sensing
