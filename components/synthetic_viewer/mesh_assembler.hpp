#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// Checks a single mesh_chunk: counts and sizes within their limits. The error message names the field, its
/// value and what is allowed.
core::Status check_chunk(const MeshChunkSample& chunk);

/// Assembles meshes from chunks that arrive in any order. A mesh is complete once all its chunks have
/// arrived, it decompresses to exactly the announced size, its hash is the announced one, its indices refer
/// to its vertices, and its coordinates are finite. Not thread-safe; allocates.
class MeshAssembler {
 public:
  /// Adds a chunk and returns the mesh if that completes it. Returns an error if the chunk or the whole mesh
  /// is not what it claims to be. All its chunks are then discarded, so that it can be sent again.
  core::Expected<std::optional<geometry::TriangleMesh>> add(MeshChunkSample chunk);
  /// Returns the number of incomplete meshes.
  std::size_t pending() const noexcept { return pending_.size(); }

 private:
  struct Pending {
    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::vector<std::vector<std::uint8_t>> chunks;  // empty: not there yet
    std::size_t missing = 0;
  };
  static core::Expected<std::optional<geometry::TriangleMesh>> unpack(std::uint64_t hash,
                                                                      const Pending& pending);

  std::map<std::uint64_t, Pending> pending_;
};

}  // namespace phantom::synthetic_viewer
