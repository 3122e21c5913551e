#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/network.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::workspace_survey {

/// The final reply of wva_server to a command.
struct ServerWord {
  bool done = false;  ///< false: refused, and the workspace is unchanged
  std::string message;
  std::uint64_t version = 0;
};

/// Sends objects to the running wva_server of the data space. One thread.
class WorkspaceClient {
 public:
  /// Joins the data space. Throws dds::DdsError.
  explicit WorkspaceClient(const core::NetworkOptions& network);
  ~WorkspaceClient();

  /// Adds an object by its YAML (at most 16384 bytes). Returns none if no new reply comes for `timeout_s`.
  std::optional<ServerWord> add(const std::string& description, double timeout_s);
  /// Moves an existing object and sets its guard skin. Returns none if no new reply comes for `timeout_s`.
  std::optional<ServerWord> move(const std::string& object, const geometry::Pose& X_WO, int guard_vox,
                                 double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_survey
