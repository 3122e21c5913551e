#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::synthetic_viewer {

/// A change of where the model has an object.
struct ModelChange {
  std::uint16_t id = 0;
  std::string name;
  geometry::Pose before_WO, after_WO;
};

/// Remembers the newest changes of objects' poses, so that they can be undone, the newest first. An object
/// that goes back to where it was before its newest change undoes that; one that is removed takes its changes
/// along. What an arm carries elsewhere has really moved, and live matter moves by itself: neither is a
/// change. A plain value. Not real-time safe.
class ModelHistory {
 public:
  static constexpr std::size_t kMax = 16;

  /// Takes an object's newest state.
  void take(const messages::WorkspaceObject& object);
  /// Forgets objects that arms carry: where they are put down is where they are.
  void forget(const std::vector<messages::CarriedObject>& carried);
  /// Returns the change that would be undone; null: none.
  const ModelChange* newest() const { return changes_.empty() ? nullptr : &changes_.back(); }

 private:
  void forget(std::uint16_t id);
  std::map<std::uint16_t, geometry::Pose> poses_;
  std::deque<ModelChange> changes_;
};

}  // namespace phantom::synthetic_viewer
