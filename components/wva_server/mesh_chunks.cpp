#include "components/wva_server/mesh_chunks.hpp"

#include <zstd.h>

#include <algorithm>
#include <stdexcept>

namespace phantom::wva_server {

std::vector<std::vector<std::uint8_t>> mesh_chunks(const geometry::TriangleMesh& mesh,
                                                   std::size_t chunk_bytes) {
  const std::vector<std::uint8_t> plain = geometry::mesh_bytes(mesh);
  std::vector<std::uint8_t> packed(ZSTD_compressBound(plain.size()));
  constexpr int kLevel = 3;
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kLevel);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  std::vector<std::vector<std::uint8_t>> chunks;
  for (std::size_t from = 0; from < size; from += chunk_bytes) {
    const auto first = packed.begin() + static_cast<std::ptrdiff_t>(from);
    chunks.emplace_back(first, first + static_cast<std::ptrdiff_t>(std::min(chunk_bytes, size - from)));
  }
  return chunks;
}

}  // namespace phantom::wva_server
