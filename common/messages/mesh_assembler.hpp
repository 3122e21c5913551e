#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::messages {

/// Assembles meshes from chunks that arrive in any order. A mesh is complete once all its chunks have
/// arrived, it decompresses to exactly the announced size, its hash is the announced one, its indices refer
/// to its vertices, and its coordinates are finite. Each chunk must be valid (its codec checks that). Not
/// thread-safe; allocates. Bounded in memory: the mesh whose first chunk came longest ago is given up.
class MeshAssembler {
 public:
  /// Greatest number of incomplete meshes.
  static constexpr std::size_t kMaxPending = 64;
  /// Greatest memory of all incomplete meshes: room for the largest mesh that the topic carries.
  static constexpr std::size_t kMaxBytes = std::size_t{512} << 20;

  /// Adds a chunk and returns the mesh if that completes it. Returns an error if the chunk or the whole mesh
  /// is not what it claims to be. All its chunks are then discarded, so that it can be sent again.
  core::Expected<std::optional<geometry::TriangleMesh>> add(MeshChunk chunk);
  /// Returns the number of incomplete meshes.
  std::size_t pending() const noexcept { return pending_.size(); }
  /// Returns the memory that they take, counting each chunk with what a map needs for it.
  std::size_t bytes() const noexcept { return bytes_; }
  /// Returns the number of incomplete meshes that were given up for others.
  std::uint64_t given_up() const noexcept { return given_up_; }

 private:
  struct Pending {
    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::uint32_t chunk_count = 0;
    std::map<std::uint32_t, std::vector<std::uint8_t>> chunks;  // those that came
    std::uint64_t order = 0;                                    // rises with each mesh that begins
    std::size_t bytes = 0;
  };
  using Meshes = std::map<std::uint64_t, Pending>;
  static core::Expected<std::optional<geometry::TriangleMesh>> unpack(std::uint64_t hash,
                                                                      const Pending& pending);

  void forget(Meshes::iterator mesh);
  void make_room(std::uint64_t newest);

  Meshes pending_;  // by content hash
  std::uint64_t next_order_ = 0, given_up_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace phantom::messages
