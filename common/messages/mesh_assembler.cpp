#include "common/messages/mesh_assembler.hpp"

#include <cinttypes>

#include "common/core/text.hpp"
#include "common/workspace/compression.hpp"

namespace phantom::messages {
namespace {

constexpr std::size_t kChunkOverhead = 128;  // bytes: a node of a map and a block of memory

core::Status refuse(std::uint64_t hash, const std::string& problem) {
  return core::Status::invalid_argument(core::formatted("mesh %" PRIx64 ": ", hash) + problem);
}

}  // namespace

core::Expected<std::optional<geometry::TriangleMesh>> MeshAssembler::add(MeshChunk chunk) {
  const auto [place, begins] = pending_.try_emplace(chunk.mesh_hash);
  Pending& pending = place->second;
  if (begins) pending = {chunk.vertex_count, chunk.triangle_count, chunk.chunk_count, {}, next_order_++, 0};
  if (pending.chunk_count != chunk.chunk_count || pending.vertex_count != chunk.vertex_count ||
      pending.triangle_count != chunk.triangle_count) {
    forget(place);
    return refuse(chunk.mesh_hash, "its chunks disagree about its counts");
  }
  const auto [piece, is_new] = pending.chunks.try_emplace(chunk.chunk);
  const std::size_t before = is_new ? 0 : piece->second.size() + kChunkOverhead,
                    after = chunk.data.size() + kChunkOverhead;
  piece->second = std::move(chunk.data);
  pending.bytes += after - before;
  bytes_ += after - before;
  if (pending.chunks.size() < pending.chunk_count) {
    make_room(chunk.mesh_hash);
    return std::optional<geometry::TriangleMesh>();
  }
  const Pending complete = std::move(pending);
  bytes_ -= complete.bytes;
  pending_.erase(place);
  return unpack(chunk.mesh_hash, complete);
}

void MeshAssembler::forget(Meshes::iterator mesh) {
  bytes_ -= mesh->second.bytes;
  pending_.erase(mesh);
}

/// Gives up the oldest meshes, but not the one that a chunk has just come for, while there are too many.
void MeshAssembler::make_room(std::uint64_t newest) {
  while (pending_.size() > 1 && (pending_.size() > kMaxPending || bytes_ > kMaxBytes)) {
    auto oldest = pending_.end();
    for (auto mesh = pending_.begin(); mesh != pending_.end(); ++mesh) {
      if (mesh->first == newest) continue;
      if (oldest == pending_.end() || mesh->second.order < oldest->second.order) oldest = mesh;
    }
    forget(oldest);
    ++given_up_;
  }
  if (bytes_ > kMaxBytes) {
    forget(pending_.begin());
    ++given_up_;
  }
}

core::Expected<std::optional<geometry::TriangleMesh>> MeshAssembler::unpack(std::uint64_t hash,
                                                                            const Pending& pending) {
  std::vector<std::uint8_t> packed;
  for (const auto& [number, chunk] : pending.chunks) packed.insert(packed.end(), chunk.begin(), chunk.end());
  const std::size_t size = 12 * (static_cast<std::size_t>(pending.vertex_count) + pending.triangle_count);
  // The zstd frame states its size, so that a wrong size is found before memory is allocated for it.
  if (workspace::content_size(packed) != size) {
    return refuse(hash, "does not unpack to the announced " + std::to_string(pending.vertex_count) +
                            " vertices and " + std::to_string(pending.triangle_count) + " triangles");
  }
  std::vector<std::uint8_t> bytes(size);
  if (!workspace::decompress(packed, bytes)) {
    return refuse(hash, "its compressed data are damaged");
  }
  geometry::TriangleMesh mesh;
  if (!geometry::mesh_from_bytes(bytes.data(), size, pending.vertex_count, pending.triangle_count, mesh)) {
    return refuse(hash, "a vertex is not finite, or a triangle names one that does not exist");
  }
  if (mesh.content_hash() != hash) return refuse(hash, "its content does not have that hash");
  return std::optional<geometry::TriangleMesh>(std::move(mesh));
}

}  // namespace phantom::messages
