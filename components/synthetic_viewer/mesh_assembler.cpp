#include "components/synthetic_viewer/mesh_assembler.hpp"

#include <zstd.h>

#include <sstream>

namespace phantom::synthetic_viewer {
namespace {

constexpr std::uint32_t kMaxChunks = 4096;
constexpr std::size_t kMaxChunkBytes = 256 * 1024;
constexpr std::uint32_t kMaxVertices = 20'000'000;
constexpr std::uint32_t kMaxTriangles = 20'000'000;

core::Status refuse(std::uint64_t hash, const std::string& problem) {
  std::ostringstream text;
  text << "mesh " << std::hex << hash << ": " << problem;
  return core::Status::invalid_argument(text.str());
}

std::string out_of_range(const char* field, std::uint64_t value, std::uint64_t greatest) {
  return std::string(field) + " " + std::to_string(value) + " is not within 1.." + std::to_string(greatest);
}

}  // namespace

core::Status check_chunk(const MeshChunkSample& chunk) {
  const auto count_fault = [&](const char* field, std::uint64_t value, std::uint64_t greatest) {
    return value >= 1 && value <= greatest ? std::string() : out_of_range(field, value, greatest);
  };
  std::string problem = count_fault("chunk_count", chunk.chunk_count, kMaxChunks);
  if (problem.empty()) problem = count_fault("vertex_count", chunk.vertex_count, kMaxVertices);
  if (problem.empty()) problem = count_fault("triangle_count", chunk.triangle_count, kMaxTriangles);
  if (problem.empty()) problem = count_fault("chunk's size in bytes", chunk.data.size(), kMaxChunkBytes);
  if (problem.empty() && chunk.chunk >= chunk.chunk_count) {
    problem =
        "chunk " + std::to_string(chunk.chunk) + " of " + std::to_string(chunk.chunk_count) + " cannot be";
  }
  return problem.empty() ? core::Status::ok() : refuse(chunk.mesh_hash, problem);
}

core::Expected<std::optional<geometry::TriangleMesh>> MeshAssembler::add(MeshChunkSample chunk) {
  if (core::Status status = check_chunk(chunk); !status.is_ok()) return status;
  Pending& pending = pending_[chunk.mesh_hash];
  if (pending.chunks.empty()) {
    pending = {chunk.vertex_count, chunk.triangle_count, {}, chunk.chunk_count};
    pending.chunks.resize(chunk.chunk_count);
  }
  if (pending.chunks.size() != chunk.chunk_count || pending.vertex_count != chunk.vertex_count ||
      pending.triangle_count != chunk.triangle_count) {
    pending_.erase(chunk.mesh_hash);
    return refuse(chunk.mesh_hash, "its chunks disagree about its counts");
  }
  std::vector<std::uint8_t>& place = pending.chunks[chunk.chunk];
  if (place.empty()) --pending.missing;
  place = std::move(chunk.data);
  if (pending.missing > 0) return std::optional<geometry::TriangleMesh>();
  const Pending complete = std::move(pending);
  pending_.erase(chunk.mesh_hash);
  return unpack(chunk.mesh_hash, complete);
}

core::Expected<std::optional<geometry::TriangleMesh>> MeshAssembler::unpack(std::uint64_t hash,
                                                                            const Pending& pending) {
  std::vector<std::uint8_t> packed;
  for (const auto& chunk : pending.chunks) packed.insert(packed.end(), chunk.begin(), chunk.end());
  const std::size_t size = 12 * (static_cast<std::size_t>(pending.vertex_count) + pending.triangle_count);
  // The zstd frame states its size, so that a wrong size is found before memory is allocated for it.
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != size) {
    return refuse(hash, "does not unpack to the announced " + std::to_string(pending.vertex_count) +
                            " vertices and " + std::to_string(pending.triangle_count) + " triangles");
  }
  std::vector<std::uint8_t> bytes(size);
  if (ZSTD_decompress(bytes.data(), size, packed.data(), packed.size()) != size) {
    return refuse(hash, "its compressed data are damaged");
  }
  geometry::TriangleMesh mesh;
  if (!geometry::mesh_from_bytes(bytes.data(), size, pending.vertex_count, pending.triangle_count, mesh)) {
    return refuse(hash, "a vertex is not finite, or a triangle names one that does not exist");
  }
  if (mesh.content_hash() != hash) return refuse(hash, "its content does not have that hash");
  return std::optional<geometry::TriangleMesh>(std::move(mesh));
}

}  // namespace phantom::synthetic_viewer
