#pragma once

#include <zstd.h>

#include <algorithm>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer::test {

/// A mesh as it comes over mesh_chunk.
inline std::vector<MeshChunkSample> chunks_of(const geometry::TriangleMesh& mesh, std::size_t chunk_bytes) {
  const auto bytes = geometry::mesh_bytes(mesh);
  std::vector<std::uint8_t> packed(ZSTD_compressBound(bytes.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 3));
  std::vector<MeshChunkSample> chunks;
  for (std::size_t begin = 0; begin < packed.size(); begin += chunk_bytes) {
    MeshChunkSample chunk;
    chunk.mesh_hash = mesh.content_hash();
    chunk.chunk = static_cast<std::uint32_t>(chunks.size());
    chunk.vertex_count = static_cast<std::uint32_t>(mesh.vertices_m.size());
    chunk.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto from = packed.begin() + static_cast<std::ptrdiff_t>(begin);
    chunk.data.assign(from, from + static_cast<std::ptrdiff_t>(std::min(chunk_bytes, packed.size() - begin)));
    chunks.push_back(std::move(chunk));
  }
  for (MeshChunkSample& chunk : chunks) chunk.chunk_count = static_cast<std::uint32_t>(chunks.size());
  return chunks;
}

}  // namespace phantom::synthetic_viewer::test
