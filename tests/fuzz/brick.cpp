// Bytes as they come in on the topics workspace_brick and mesh_chunk.

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/brick_codec.hpp"
#include "common/workspace/brick_tiles.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace phantom;
  const auto brick = std::make_unique<workspace::BrickContent>(),
             again = std::make_unique<workspace::BrickContent>();
  const auto expect_again =
      [&](const core::Status& status) {  // as it was, and so must be what is known of it
        const auto& [voxels, facts] = *brick;
        const workspace::BrickFacts literal = workspace::facts_of(voxels);
        if (!status || std::memcmp(&voxels, &again->voxels, sizeof voxels) != 0 ||
            facts.object != literal.object || facts.uniform != literal.uniform ||
            facts.greatest_code != literal.greatest_code ||
            facts.greatest_fluid_code != literal.greatest_fluid_code)
          std::abort();
      };
  if (workspace::decode_brick({bytes, size}, *brick))
    expect_again(workspace::decode_brick(workspace::encode_brick(brick->voxels.view()), *again));
  if (workspace::untile_brick({bytes, size}, *brick)) {  // what lies behind the checksum
    std::vector<std::uint8_t> tiled(workspace::kMaxTiledBytes);
    tiled.resize(workspace::tile_brick(brick->voxels.view(),
                                       std::span<std::uint8_t, workspace::kMaxTiledBytes>(tiled)));
    expect_again(workspace::untile_brick(tiled, *again));
  }
  if (size < 8) return 0;
  std::uint32_t counts[2];
  std::memcpy(counts, bytes, sizeof counts);
  geometry::TriangleMesh mesh;
  for (const std::uint32_t mask : {0xffffffffU, 0xfU}) {
    if (!geometry::mesh_from_bytes(bytes + 8, size - 8, counts[0] & mask, counts[1] & mask, mesh)) continue;
    if (!mesh.all_finite()) std::abort();
    for (const auto& t : mesh.triangles) {
      for (const auto v : t) {
        if (v >= mesh.vertices_m.size()) std::abort();
      }
    }
  }
  return 0;
}
