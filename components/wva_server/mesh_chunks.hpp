#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/mesh.hpp"

namespace phantom::wva_server {

/// A mesh as it travels on mesh_chunk: zstd of geometry::mesh_bytes, cut into pieces of at most
/// `chunk_bytes`.
std::vector<std::vector<std::uint8_t>> mesh_chunks(const geometry::TriangleMesh& mesh,
                                                   std::size_t chunk_bytes);

}  // namespace phantom::wva_server
