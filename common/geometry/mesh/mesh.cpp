#include "common/geometry/mesh/mesh.hpp"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstring>

namespace phantom::geometry {

// Meshes are sent to other hosts and hashed as little-endian bytes straight from memory.
static_assert(std::endian::native == std::endian::little, "big-endian hosts need a conversion here");
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(std::array<std::uint32_t, 3>) == 12);

namespace {

std::uint64_t fnv1a(std::uint64_t hash, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3ULL;
  return hash;
}

}  // namespace

BoundingBox TriangleMesh::bounding_box() const {
  BoundingBox box;
  // Processes four vertices at a time, whose coordinates fill three vectors.
  using Four = Eigen::Array<float, 3, 4>;
  const auto count = static_cast<Eigen::Index>(vertices_m.size()), whole = count / 4 * 4;
  if (whole > 0) {
    const float* from = vertices_m.data()->data();
    // The sum stays 0 unless a term is not finite: 0 · ∞ and 0 · NaN are NaN.
    Four low = Eigen::Map<const Four>(from), high = low, nothing = 0.0F * low;
    for (Eigen::Index i = 4; i < whole; i += 4) {
      const Eigen::Map<const Four> here(from + 3 * i);
      low = low.min(here);
      high = high.max(here);
      nothing += 0.0F * here;
    }
    box.finite = (nothing == 0.0F).all();
    box.min_m = low.rowwise().minCoeff();
    box.max_m = high.rowwise().maxCoeff();
  }
  for (Eigen::Index i = whole; i < count; ++i) box.extend(vertices_m[static_cast<std::size_t>(i)]);
  return box;
}

TriangleMesh TriangleMesh::transformed(const Pose& X_AB) const {
  TriangleMesh moved{{}, triangles};
  moved.vertices_m.reserve(vertices_m.size());
  for (const auto& vertex : vertices_m)
    moved.vertices_m.push_back((X_AB * vertex.cast<double>()).cast<float>());
  return moved;
}

std::uint64_t TriangleMesh::content_hash() const {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  hash = fnv1a(hash, vertices_m.data(), vertices_m.size() * 12);
  return fnv1a(hash, triangles.data(), triangles.size() * 12);
}

void TriangleMesh::append(const TriangleMesh& other) {
  const auto base = static_cast<std::uint32_t>(vertices_m.size());
  vertices_m.insert(vertices_m.end(), other.vertices_m.begin(), other.vertices_m.end());
  triangles.reserve(triangles.size() + other.triangles.size());
  for (const auto& t : other.triangles) triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

double enclosed_volume_m3(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices_m[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices_m[t[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices_m[t[2]].cast<double>();
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6.0;
}

std::vector<std::uint8_t> mesh_bytes(const TriangleMesh& mesh) {
  const std::size_t vertex_bytes = mesh.vertices_m.size() * 12;
  const std::size_t triangle_bytes = mesh.triangles.size() * 12;
  std::vector<std::uint8_t> bytes(vertex_bytes + triangle_bytes);
  if (vertex_bytes != 0) std::memcpy(bytes.data(), mesh.vertices_m.data(), vertex_bytes);
  if (triangle_bytes != 0) std::memcpy(bytes.data() + vertex_bytes, mesh.triangles.data(), triangle_bytes);
  return bytes;
}

bool mesh_from_bytes(const std::uint8_t* bytes, std::size_t size, std::uint32_t vertex_count,
                     std::uint32_t triangle_count, TriangleMesh& mesh) {
  const std::size_t vertex_bytes = std::size_t{vertex_count} * 12;
  const std::size_t triangle_bytes = std::size_t{triangle_count} * 12;
  if (size != vertex_bytes + triangle_bytes) return false;
  mesh.vertices_m.resize(vertex_count);
  mesh.triangles.resize(triangle_count);
  if (vertex_bytes != 0) std::memcpy(static_cast<void*>(mesh.vertices_m.data()), bytes, vertex_bytes);
  if (triangle_bytes != 0) std::memcpy(mesh.triangles.data(), bytes + vertex_bytes, triangle_bytes);
  for (const auto& vertex : mesh.vertices_m) {
    if (!vertex.allFinite()) return false;
  }
  for (const auto& t : mesh.triangles) {
    if (t[0] >= vertex_count || t[1] >= vertex_count || t[2] >= vertex_count) return false;
  }
  return true;
}

}  // namespace phantom::geometry
