#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::phantom_sensing {

/// Compares the objects of two workspaces of one cell: the arm's, and a share's of its own. A command that
/// moves, adds or removes an object reaches one wva_server; until the other has been told the same, the skin
/// feels one object at two places.
class SecondaryWorkspace {
 public:
  using Objects = std::map<std::uint16_t, messages::WorkspaceObject>;  ///< by id

  /// How long they may differ before it is told: a command to one comes after that to the other.
  static constexpr core::Nanoseconds kReportedAfter_ns = 2 * core::kNsPerSecond;

  /// Returns the objects with those that an arm carries at their places in its link, in other words than
  /// where they stood before.
  static Objects with_carried(Objects objects, const std::vector<messages::CarriedObject>& carried);

  /// Takes the objects in force. `here`, `there`: empty while no server has announced any, which is no
  /// difference. Returns the names of those that stand, or are carried, at different poses, or
  /// are in one workspace only, and have been so for kReportedAfter_ns; in their order of id.
  std::vector<std::string> compare(const Objects& here, const Objects& there, core::Nanoseconds now_ns);

 private:
  std::map<std::uint16_t, core::Nanoseconds> since_ns_;  // of what differs
};

}  // namespace phantom::phantom_sensing
