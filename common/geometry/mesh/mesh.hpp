#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/geometry/pose.hpp"

namespace phantom::geometry {

/// An axis-aligned box; empty (min > max) until it is extended.
struct BoundingBox {
  Eigen::Vector3f min_m = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f max_m = Eigen::Vector3f::Constant(-std::numeric_limits<float>::infinity());
  bool finite = true;  ///< false: a coordinate was not finite, and the box has no meaning

  bool empty() const { return min_m.x() > max_m.x(); }
  void extend(const Eigen::Vector3f& point_m) {
    min_m = min_m.cwiseMin(point_m);
    max_m = max_m.cwiseMax(point_m);
    finite = finite && point_m.allFinite();
  }
  bool intersects(const BoundingBox& other) const {
    return (min_m.array() <= other.max_m.array()).all() && (other.min_m.array() <= max_m.array()).all();
  }
};

/// Triangle soup with shared vertices, in the object's frame unless the variable's name says otherwise.
/// Triangles are counter-clockwise seen from outside if the source guarantees that; nothing here relies on
/// it.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into vertices_m

  /// Returns the box around all vertices, including those that no triangle uses; empty for a mesh without
  /// vertices.
  BoundingBox bounding_box() const;
  /// Returns whether no coordinate is NaN or infinite.
  bool all_finite() const { return bounding_box().finite; }
  /// Returns the mesh with every vertex transformed by `X_AB`, from frame B into frame A.
  TriangleMesh transformed(const Pose& X_AB) const;
  /// Returns the FNV-1a 64 hash of the vertices (float32 xyz, little endian) and then the triangles (uint32
  /// abc, little endian): the key of the topic mesh_chunk.
  std::uint64_t content_hash() const;
  /// Appends another mesh's triangles.
  void append(const TriangleMesh& other);
};

/// Returns the volume enclosed by a closed mesh whose triangles face outwards, m³ (divergence theorem).
double enclosed_volume_m3(const TriangleMesh& mesh);

/// Returns the bytes that content_hash() covers and that mesh_chunk carries (compressed): vertices, then
/// triangles.
std::vector<std::uint8_t> mesh_bytes(const TriangleMesh& mesh);

/// Decodes the bytes of mesh_bytes(). Returns false if the size does not match the counts, a coordinate is
/// not finite or an index lies outside the vertices.
bool mesh_from_bytes(const std::uint8_t* bytes, std::size_t size, std::uint32_t vertex_count,
                     std::uint32_t triangle_count, TriangleMesh& mesh);

}  // namespace phantom::geometry
