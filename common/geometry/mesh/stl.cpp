#include "common/geometry/mesh/stl.hpp"

#include <cstring>

#include "common/geometry/mesh/vertex_welder.hpp"

namespace phantom::geometry {
namespace {

constexpr std::size_t kCountAt = 80, kTriangleBytes = 50, kNormalBytes = 12, kCornerBytes = 12;
constexpr std::uint32_t kAhead = 8;  // triangles

std::optional<std::uint32_t> count_in(std::span<const std::uint8_t> head) {
  if (head.size() < kStlHeadBytes) return std::nullopt;
  std::uint32_t count = 0;
  std::memcpy(&count, head.data() + kCountAt, sizeof count);
  return count;
}

}  // namespace

std::uint64_t binary_stl_bytes(std::uint32_t triangles) {
  return kStlHeadBytes + std::uint64_t{kTriangleBytes} * triangles;
}

std::optional<std::uint32_t> binary_stl_triangles(std::span<const std::uint8_t> head, std::uint64_t size) {
  const auto count = count_in(head);
  return count && size == binary_stl_bytes(*count) ? count : std::nullopt;
}

std::optional<std::uint32_t> binary_stl_triangles_within(std::span<const std::uint8_t> head,
                                                         std::uint64_t size) {
  const auto count = count_in(head);
  return count && *count > 0 && size >= binary_stl_bytes(*count) ? count : std::nullopt;
}

StlMesh read_binary_stl(std::span<const std::uint8_t> bytes) {
  StlMesh mesh;
  const std::uint32_t count = binary_stl_triangles(bytes, bytes.size()).value_or(0);
  detail::VertexWelder corners(mesh);
  corners.expect(count);
  const std::uint8_t* at = bytes.data() + kStlHeadBytes + kNormalBytes;
  std::array<Eigen::Vector3f, 3> positions;
  static_assert(sizeof positions == 3 * kCornerBytes);
  for (std::uint32_t i = 0; i < count; ++i, at += kTriangleBytes) {
    if (i + kAhead < count) {
      std::memcpy(static_cast<void*>(positions.data()), at + kAhead * kTriangleBytes, sizeof positions);
      for (const auto& position : positions) corners.prefetch(position);
    }
    std::memcpy(static_cast<void*>(positions.data()), at, sizeof positions);
    corners.triangle(
        {corners.vertex(positions[0]), corners.vertex(positions[1]), corners.vertex(positions[2])});
  }
  mesh.collapsed = corners.collapsed();
  mesh.finite = corners.finite();
  return mesh;
}

std::vector<std::uint8_t> binary_stl(const TriangleMesh& mesh) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<std::uint8_t> bytes(kStlHeadBytes + kTriangleBytes * mesh.triangles.size(), 0);
  std::memcpy(bytes.data() + kCountAt, &count, sizeof count);
  std::uint8_t* at = bytes.data() + kStlHeadBytes;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k)
      std::memcpy(at + kNormalBytes + k * kCornerBytes, mesh.vertices_m[triangle[k]].data(), kCornerBytes);
    at += kTriangleBytes;
  }
  return bytes;
}

}  // namespace phantom::geometry
