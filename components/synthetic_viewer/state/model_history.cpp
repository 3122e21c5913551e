#include "components/synthetic_viewer/state/model_history.hpp"

#include "common/messages/living.hpp"

namespace phantom::synthetic_viewer {

using geometry::same_pose;

void ModelHistory::forget(std::uint16_t id) {
  poses_.erase(id);
  std::erase_if(changes_, [id](const ModelChange& change) { return change.id == id; });
}

void ModelHistory::forget(const std::vector<messages::CarriedObject>& carried) {
  for (const messages::CarriedObject& object : carried) forget(object.id);
}

void ModelHistory::take(const messages::WorkspaceObject& object) {
  if (messages::is_live(object.id)) return;
  if (object.removed()) return forget(object.id);
  const auto [known, is_new] = poses_.try_emplace(object.id, object.X_WO);
  const geometry::Pose before_WO = known->second;
  known->second = object.X_WO;
  if (is_new || same_pose(before_WO, object.X_WO)) return;
  if (!changes_.empty() && changes_.back().id == object.id &&
      same_pose(changes_.back().before_WO, object.X_WO)) {
    changes_.pop_back();
    return;
  }
  changes_.push_back({object.id, object.name, before_WO, object.X_WO});
  if (changes_.size() > kMax) changes_.pop_front();
}

}  // namespace phantom::synthetic_viewer
