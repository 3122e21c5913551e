#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::wva_server {

/// Returns a mesh as mesh_chunk carries it: geometry::mesh_bytes compressed with zstd, cut into pieces of at
/// most `chunk_bytes`.
std::vector<std::vector<std::uint8_t>> mesh_chunks(const geometry::TriangleMesh& mesh,
                                                   std::size_t chunk_bytes);

}  // namespace phantom::wva_server
