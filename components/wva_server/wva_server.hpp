#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/voxel/activation.hpp"
#include "common/runtime/cell_bodies.hpp"

namespace phantom::wva_server {

/// What was activated, for logs, status and reports.
struct ActivatedObject {
  std::string name;
  std::uint16_t id = 0;
  std::size_t vertices = 0;
  voxel::BodyReport report;
};

/// The activated cell: one whole version.
struct ActivatedCell {
  std::shared_ptr<const voxel::Workspace> workspace;
  std::vector<ActivatedObject> objects;
  double merge_s = 0.0, build_s = 0.0;
};

/// Called after each object with how many of how many are done.
using OnProgress = std::function<void(const ActivatedObject& object, std::size_t done, std::size_t all)>;

/// Activates the cell: bodies in, workspace of version `version` out. Pure but for the stopwatch that the
/// reports are made with. `go_on` is asked before each object; when it says no, the result's workspace is
/// null. Not real-time safe. Throws runtime::ConfigError for a body that cannot be activated.
ActivatedCell activate(const voxel::GridSpec& grid, const std::vector<runtime::CellBody>& bodies,
                       std::uint64_t version, const voxel::Stopwatch& stopwatch,
                       const OnProgress& on_progress, const std::function<bool()>& go_on);

/// One line for the log: what an object's activation found.
std::string describe(const ActivatedObject& object);

}  // namespace phantom::wva_server
