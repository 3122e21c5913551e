// Bytes as they come in on the topics workspace_brick and mesh_chunk.

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "common/geometry/mesh.hpp"
#include "common/voxel/brick_codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace phantom;
  const auto brick = std::make_unique<voxel::BrickData>();
  if (voxel::decode_brick({bytes, size}, *brick)) {  // then it must come back from its own bytes
    const auto encoded = voxel::encode_brick(brick->view());
    const auto again = std::make_unique<voxel::BrickData>();
    if (!voxel::decode_brick(encoded, *again) || std::memcmp(brick.get(), again.get(), sizeof *brick) != 0)
      std::abort();
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
