#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/network.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::workspace_survey {

/// Listens to what the running system says about its arm and objects. Thread-safe.
class SystemListener {
 public:
  using OnState = std::function<void(const messages::Received<messages::SlaveState>&)>;

  /// Takes states of an arm within `arm` only. `on_state` is called on the middleware's thread. Throws
  /// dds::DdsError.
  SystemListener(const core::NetworkOptions& network, const messages::ArmBounds& arm, OnState on_state);
  ~SystemListener();
  SystemListener(const SystemListener&) = delete;
  SystemListener& operator=(const SystemListener&) = delete;

  /// Returns the objects in force, by id.
  std::map<std::uint16_t, messages::WorkspaceObject> objects() const;
  /// Returns a mesh once all of it has come.
  std::optional<geometry::TriangleMesh> mesh(std::uint64_t hash) const;
  /// Returns the places at which phantom_sensing found that the arm's contacts contradict the model.
  std::vector<messages::ModelDoubt> doubts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_survey
