#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/core/status.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/pose_findings.hpp"
#include "common/messages/workspace.hpp"
#include "components/synthetic_viewer/state/model_history.hpp"

namespace phantom::synthetic_viewer {

/// What the operator may correct in the model from the page: an object by the shift that explains a doubt,
/// once and only while it stands where it stood when the doubt arose; an object to where a camera has found
/// it, likewise; and the newest change, back. What is asked for is named as the page shows it, so that
/// nothing else is moved. Not thread-safe; not real-time safe.
class ModelCorrections {
 public:
  /// Takes an object in force, or that it is gone.
  void take(const messages::WorkspaceObject& object);
  /// Takes a version in force: which objects arms carry now.
  void take(std::uint64_t version, const std::vector<messages::CarriedObject>& carried);
  /// Takes a doubt. Those of another phantom are forgotten with the first of a new one.
  void take(const messages::ModelDoubt& doubt);
  /// Takes what a camera has found of an object.
  void take(const messages::PoseFinding& finding) { findings_.take(finding); }

  /// Returns the move that explains a doubt, by its running number; an error that says why there is none.
  core::Expected<messages::WorkspaceCommand> correct(std::uint32_t number) const;
  /// Returns the move of the object of this name to where a camera has found it.
  core::Expected<messages::WorkspaceCommand> accept(const std::string& object) const;
  /// Returns the move that undoes the newest change, if that is of the object of this name.
  core::Expected<messages::WorkspaceCommand> undo(const std::string& object) const;

 private:
  struct Object {
    std::string name;
    geometry::Pose X_WO;
    std::uint64_t since_version = 0;  // in which it stood there first, as far as is known; 0: not known yet
  };
  struct Kept {
    messages::ModelDoubt doubt;
    geometry::Pose X_WO;  // of its object, when it came
    bool has_object = false;
  };
  std::map<std::uint16_t, Object> objects_;
  std::map<std::uint32_t, Kept> doubts_;  // by their places
  messages::PoseFindings findings_;
  ModelHistory history_;
  std::uint64_t version_ = 0;
};

}  // namespace phantom::synthetic_viewer
