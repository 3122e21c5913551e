#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/network.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::workspace_survey {

/// What wva_server says last about a request.
struct ServerWord {
  bool done = false;  ///< else it refused, and the workspace is as before
  std::string message;
  std::uint64_t version = 0;
};

/// Tells the running wva_server of the data space what was found. One thread.
class WorkspaceClient {
 public:
  /// Joins the data space. Throws dds::DdsError.
  explicit WorkspaceClient(const core::NetworkOptions& network);
  ~WorkspaceClient();

  /// Adds an object by its YAML (at most 16384 bytes). None if there was no word for `timeout_s`.
  std::optional<ServerWord> add(const std::string& description, double timeout_s);
  /// Moves an object that is there, and gives it a guard skin.
  std::optional<ServerWord> move(const std::string& object, const geometry::Pose& X_WO, int guard_vox,
                                 double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_survey
