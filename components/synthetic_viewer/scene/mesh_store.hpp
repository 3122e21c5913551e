#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::synthetic_viewer {

/// Returns octets compressed by gzip, as browsers take them. Throws std::bad_alloc.
std::string gzip(std::string_view octets);

/// Returns a mesh as browsers get it, compressed by gzip: number of vertices and of triangles (uint32),
/// float32 xyz of each vertex, uint32 abc of each triangle, all little endian. Throws std::bad_alloc.
std::string packed_mesh(const geometry::TriangleMesh& mesh);

/// Returns a content hash as 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);
/// Returns the hash that a text of 16 hexadecimal digits in lower case is; none for any other text.
std::optional<std::uint64_t> hash_from_text(std::string_view text);

/// The meshes of the scene by content hash, for browsers. Each is packed when it is asked for first, and then
/// kept packed only. Thread-safe.
class MeshStore {
 public:
  using Packed = std::shared_ptr<const std::string>;

  void put(std::uint64_t hash, geometry::TriangleMesh mesh);
  void drop(std::uint64_t hash);
  /// Returns packed_mesh() of a mesh; null: there is none of that hash. The first call for a mesh computes
  /// for some 50 ms a million octets; others ask for other meshes meanwhile without waiting.
  Packed packed(std::uint64_t hash);

 private:
  struct Entry {
    std::mutex mutex;
    geometry::TriangleMesh mesh;  ///< until it is packed
    Packed packed;
  };
  std::mutex mutex_;
  std::map<std::uint64_t, std::shared_ptr<Entry>> entries_;
};

}  // namespace phantom::synthetic_viewer
