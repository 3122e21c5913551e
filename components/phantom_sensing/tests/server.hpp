#pragma once

#include <string>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing::rig {

/// Sends a workspace, as a wva_server would.
class Server {
 public:
  Server(const core::NetworkOptions& network, std::uint64_t version, const std::string& object,
         const workspace::Workspace& world = rig::wall())
      : participant_("wva_server", network), world_(world) {
    for (const workspace::BrickKey key : world.bricks()) {
      const std::vector<std::uint8_t> voxels = workspace::encode_brick(world.brick(key));
      bricks_.write(messages::to_idl(messages::WorkspaceBrick{key, version, voxels}));
    }
    objects_.write(messages::to_idl(messages::WorkspaceObject{1, object, 5, {}, {}}));
    commit(version, world.grid().voxel_size_m);
  }
  void commit(std::uint64_t number, const workspace::VoxelSize& voxel_size_m) {
    messages::WorkspaceVersion version{"cell", workspace::description_of(world_, world_.content_hash())};
    version.description.version = number;
    version.description.grid.voxel_size_m = voxel_size_m;
    versions_.write(messages::to_idl(version));
  }

 private:
  dds::Participant participant_;
  const workspace::Workspace& world_;
  dds::Writer<msg::WorkspaceBrick> bricks_{participant_, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions_{participant_, dds::kWorkspaceVersion};
  dds::Writer<msg::WorkspaceObject> objects_{participant_, dds::kWorkspaceObject};
};

}  // namespace phantom::phantom_sensing::rig
