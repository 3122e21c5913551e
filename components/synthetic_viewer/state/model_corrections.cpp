#include "components/synthetic_viewer/state/model_corrections.hpp"

#include <algorithm>

#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer {
namespace {

using geometry::same_pose;

core::Status refused(const std::string& why) { return core::Status::invalid_argument(why); }

messages::WorkspaceCommand move_to(std::uint16_t id, const geometry::Pose& X_WO) {
  messages::WorkspaceCommand command;
  command.operation = messages::WorkspaceOperation::kMove;
  command.id = id;
  command.X_WO = X_WO;
  return command;
}

}  // namespace

void ModelCorrections::take(const messages::WorkspaceObject& object) {
  history_.take(object);
  if (object.removed()) {
    objects_.erase(object.id);
    return;
  }
  const auto [known, is_new] = objects_.try_emplace(object.id, Object{object.name, object.X_WO, version_});
  if (!is_new && !same_pose(known->second.X_WO, object.X_WO))
    known->second = {object.name, object.X_WO, version_};
}

void ModelCorrections::take(std::uint64_t version, const std::vector<messages::CarriedObject>& carried) {
  version_ = version;
  for (auto& [id, object] : objects_)
    if (object.since_version == 0) object.since_version = version;
  history_.forget(carried);
}

void ModelCorrections::take(const messages::ModelDoubt& doubt) {
  if (!doubts_.empty() && doubts_.begin()->second.doubt.stamp.session != doubt.stamp.session) doubts_.clear();
  const auto object = objects_.find(doubt.object);
  const bool known = object != objects_.end();
  Kept& kept = doubts_[doubt.place];
  // The end of a doubt comes with its number: the object may have been moved meanwhile.
  const bool ends = kept.doubt.doubt == doubt.doubt;
  kept.doubt = doubt;
  if (ends) return;
  kept.has_object = known;
  if (known) kept.X_WO = object->second.X_WO;
}

core::Expected<messages::WorkspaceCommand> ModelCorrections::correct(std::uint32_t number) const {
  const auto found = std::ranges::find_if(
      doubts_, [number](const auto& entry) { return entry.second.doubt.doubt == number; });
  if (found == doubts_.end())
    return refused("doubt " + std::to_string(number) + " of the model is not kept any more");
  const Kept& kept = found->second;
  const Eigen::Vector3d shift_m = messages::eigen(kept.doubt.shift_m);
  const auto object = objects_.find(kept.doubt.object);
  if (shift_m.isZero() || !kept.has_object || object == objects_.end())
    return refused("no object explains it by a shift; touch it more often: workspace_survey touch --kept");
  if (!same_pose(object->second.X_WO, kept.X_WO) ||
      kept.doubt.workspace_version < object->second.since_version)
    return refused("its object has been moved since; touch it again");
  geometry::Pose X_WO = kept.X_WO;
  X_WO.translation_m += shift_m;
  return move_to(object->first, X_WO);
}

core::Expected<messages::WorkspaceCommand> ModelCorrections::accept(const std::string& name) const {
  const auto object =
      std::ranges::find_if(objects_, [&](const auto& entry) { return entry.second.name == name; });
  const messages::PoseFinding* const found = object == objects_.end() ? nullptr : findings_.of(object->first);
  if (found == nullptr || found->verdict != messages::PoseVerdict::kElsewhere)
    return refused("no camera has found where '" + name + "' stands");
  if (findings_.displacing(object->first, object->second.X_WO) == nullptr)
    return refused("'" + name + "' has been moved since a camera found it; wait until it is seen again");
  return move_to(object->first, found->corrected_WO);
}

core::Expected<messages::WorkspaceCommand> ModelCorrections::undo(const std::string& object) const {
  const ModelChange* const change = history_.newest();
  if (change == nullptr) return refused("no change of the model is known that could be undone");
  if (change->name != object)
    return refused("the newest change is of '" + change->name + "', not of '" + object + "'");
  return move_to(change->id, change->before_WO);
}

}  // namespace phantom::synthetic_viewer
