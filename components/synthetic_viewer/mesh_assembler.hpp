#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// Checks a mesh_chunk by itself: counts and sizes within their limits. The message names the field, its
/// value and what is allowed.
core::Status check_chunk(const MeshChunkSample& chunk);

/// Puts the meshes together that arrive in chunks, in any order. A mesh is given out once all its chunks are
/// there, it decompresses to exactly the announced size, its hash is the announced one, its indices point at
/// its vertices, and its coordinates are finite. Not thread-safe; allocates.
class MeshAssembler {
 public:
  /// The mesh if `chunk` completes one. An error means that the chunk or the whole mesh is not what it
  /// claims; all its chunks are then forgotten, so that sending it again heals it.
  core::Expected<std::optional<geometry::TriangleMesh>> add(MeshChunkSample chunk);
  /// Meshes of which some chunks are there.
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
