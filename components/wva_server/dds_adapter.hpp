#pragma once

#include <memory>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/runtime/cell.hpp"
#include "common/voxel/workspace.hpp"
#include "common/runtime/cell_bodies.hpp"

namespace phantom::wva_server {

/// The component's ends in the data space: workspace_brick, workspace_version, workspace_object, mesh_chunk
/// and component_status out. What was published stays with the writers, so that late joiners get all of it.
/// One thread.
class DdsAdapter {
 public:
  /// Throws dds::DdsError.
  explicit DdsAdapter(const core::NetworkOptions& network);
  ~DdsAdapter();

  /// Objects, and their meshes once each however many objects share one.
  void publish_objects(const runtime::CellConfig& cell, const std::vector<runtime::CellBody>& bodies,
                       std::size_t chunk_bytes);
  /// All bricks, then the version that commits them. Bricks of an earlier version that are gone are disposed.
  void publish_workspace(const std::string& cell_name, const voxel::Workspace& workspace);
  /// Publishes component_status.
  void report(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
