#include "common/voxel/voxelise.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/voxel/snapped_mesh.hpp"

namespace phantom::voxel {
namespace {

using detail::kReach;
using detail::kSub;
using detail::SnappedPoint;
using detail::SnappedTriangle;
using Corners = std::array<std::uint32_t, 3>;

std::uint64_t scramble(std::uint64_t h) {
  h = (h ^ (h >> 31)) * 0x9e3779b97f4a7c15ULL;
  h = (h ^ (h >> 29)) * 0xd6e8feb86659fd93ULL;
  return h ^ (h >> 32);
}

/// The same triangle, the same way round, always named alike.
Corners canonical(Corners t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// Triangles without those named before.
std::vector<Corners> without_duplicates(const std::vector<Corners>& triangles, std::size_t& duplicates) {
  std::size_t slots = 16;
  while (slots < 2 * triangles.size()) slots *= 2;
  std::vector<std::uint32_t> table(slots, 0);  // index + 1 into `unique`
  std::vector<Corners> unique;
  unique.reserve(triangles.size());
  for (const Corners& triangle : triangles) {
    const Corners t = canonical(triangle);
    std::size_t slot =
        scramble(t[0] + (static_cast<std::uint64_t>(t[1]) << 32) + scramble(t[2])) & (slots - 1);
    while (table[slot] != 0 && unique[table[slot] - 1] != t) slot = (slot + 1) & (slots - 1);
    if (table[slot] != 0) {
      ++duplicates;
      continue;
    }
    unique.push_back(t);
    table[slot] = static_cast<std::uint32_t>(unique.size());
  }
  return unique;
}

/// Whether every edge belongs to an even number of triangles: the XOR of a scrambled name per edge cancels
/// out.
bool is_closed(const std::vector<Corners>& triangles) {
  std::uint64_t sum = 0;
  for (const Corners& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      sum ^= scramble((std::min(a, b) << 32 | std::max(a, b)) + 1);
    }
  }
  return sum == 0;
}

/// Vertices in 1/kSub voxel from the box's corner; false if one is out of reach.
bool snap(const geometry::TriangleMesh& mesh_W, const GridSpec& grid, const VoxelBox& box,
          std::vector<SnappedPoint>& points) {
  points.reserve(mesh_W.vertices_m.size());
  const Eigen::Vector3d corner(box.min.x, box.min.y, box.min.z);
  for (const auto& vertex : mesh_W.vertices_m) {
    const Eigen::Vector3d p =
        ((vertex.cast<double>() - grid.origin_m) / grid.voxel_size_m - corner) * static_cast<double>(kSub);
    if (!(p.cwiseAbs().maxCoeff() < static_cast<double>(kReach))) return false;
    points.push_back({std::llround(p.x()), std::llround(p.y()), std::llround(p.z())});
  }
  return true;
}

void fill_along_x(BitVolume& volume) {
  const std::size_t words = volume.words_per_row();
  for (std::int32_t z = 0; z < volume.size()[2]; ++z) {
    for (std::int32_t y = 0; y < volume.size()[1]; ++y) {
      std::uint64_t* row = volume.row(y, z);
      std::uint64_t carry = 0;  // all ones while inside
      for (std::size_t i = 0; i < words; ++i) {
        std::uint64_t w = row[i];
        for (int shift = 1; shift < 64; shift *= 2) w ^= w << shift;
        row[i] = w ^ carry;
        carry = row[i] >> 63 != 0 ? ~std::uint64_t{0} : 0;
      }
      if (const int rest = volume.size()[0] & 63; rest != 0) row[words - 1] &= (std::uint64_t{1} << rest) - 1;
    }
  }
}

/// The same along y or z, where 64 lines stand side by side in a word.
void fill_along(int axis, BitVolume& volume) {
  if (axis == 0) return fill_along_x(volume);
  for (std::int32_t z = axis == 2 ? 1 : 0; z < volume.size()[2]; ++z) {
    for (std::int32_t y = axis == 1 ? 1 : 0; y < volume.size()[1]; ++y) {
      std::uint64_t* row = volume.row(y, z);
      const std::uint64_t* before = axis == 1 ? volume.row(y - 1, z) : volume.row(y, z - 1);
      for (std::size_t i = 0; i < volume.words_per_row(); ++i) row[i] ^= before[i];
    }
  }
}

/// Empties the lines that cross the surface an odd number of times: they say nothing about inside.
void silence_odd_lines(int axis, const BitVolume& parity, BitVolume& volume) {
  const auto& size = volume.size();
  for (std::int32_t z = 0; z < size[2]; ++z) {
    for (std::int32_t y = 0; y < size[1]; ++y) {
      std::uint64_t* row = volume.row(y, z);
      for (std::int32_t x = 0; x < size[0]; ++x) {
        const std::int32_t index[3] = {x, y, z};
        if (parity.get(index[(axis + 1) % 3], index[(axis + 2) % 3], 0))
          row[x >> 6] &= ~(std::uint64_t{1} << (x & 63));
      }
    }
  }
}

BitVolume inside_along(int axis, const std::vector<SnappedTriangle>& triangles, const VoxelBox& box,
                       bool closed) {
  BitVolume inside(box.size);
  BitVolume parity({box.size[static_cast<std::size_t>((axis + 1) % 3)],
                    box.size[static_cast<std::size_t>((axis + 2) % 3)], 1});
  detail::toggle_crossings(triangles, axis, inside, parity);
  fill_along(axis, inside);
  if (!closed) silence_odd_lines(axis, parity, inside);
  return inside;
}

BitVolume vote(const std::vector<SnappedTriangle>& triangles, const VoxelBox& box, std::size_t& disputed) {
  BitVolume a = inside_along(0, triangles, box, false);
  const BitVolume b = inside_along(1, triangles, box, false);
  const BitVolume c = inside_along(2, triangles, box, false);
  for (std::size_t i = 0; i < a.words().size(); ++i) {
    const std::uint64_t x = a.words()[i], y = b.words()[i], z = c.words()[i];
    a.words()[i] = (x & y) | (y & z) | (z & x);
    disputed += static_cast<std::size_t>(std::popcount((x ^ y) | (y ^ z)));
  }
  return a;
}

}  // namespace

VoxelBox voxel_bounds(const geometry::TriangleMesh& mesh_W, const GridSpec& grid) {
  const geometry::BoundingBox box = mesh_W.bounding_box();
  if (box.empty()) return {};
  const Index3 first = grid.index_of(box.min_m.cast<double>());
  const Index3 last = grid.index_of(box.max_m.cast<double>());
  // One voxel more on each side: snapping may carry a vertex across a border.
  return {{first.x - 1, first.y - 1, first.z - 1},
          {last.x - first.x + 3, last.y - first.y + 3, last.z - first.z + 3}};
}

core::Expected<SolidVoxels> voxelise(const geometry::TriangleMesh& mesh_W, const GridSpec& grid,
                                     const VoxelBox& clip) {
  SolidVoxels solid;
  solid.report.triangles = mesh_W.triangles.size();
  const core::Status too_far(core::ErrorCode::kResourceExhausted,
                             "mesh reaches farther than " + std::to_string(kReach / kSub) +
                                 " voxels from the workspace; is its scale right?");
  const geometry::BoundingBox bounds = mesh_W.bounding_box();
  if (bounds.empty()) return solid;
  if (!(std::max(-bounds.min_m.minCoeff(), bounds.max_m.maxCoeff()) < 1e6F)) return too_far;
  solid.box = voxel_bounds(mesh_W, grid).intersection(clip);
  if (solid.box.empty()) return solid;
  std::vector<SnappedPoint> points;
  if (!snap(mesh_W, grid, solid.box, points)) return too_far;
  const std::vector<Corners> unique = without_duplicates(mesh_W.triangles, solid.report.duplicate_triangles);
  solid.report.closed = is_closed(unique);
  std::vector<SnappedTriangle> triangles;
  triangles.reserve(unique.size());
  for (const Corners& t : unique) triangles.push_back({points[t[0]], points[t[1]], points[t[2]]});

  solid.inside = solid.report.closed ? inside_along(0, triangles, solid.box, true)
                                     : vote(triangles, solid.box, solid.report.disputed_voxels);
  solid.boundary = BitVolume(solid.box.size);
  for (const SnappedTriangle& triangle : triangles) detail::mark_triangle(triangle, solid.boundary);
  solid.interior = solid.inside;
  for (std::size_t i = 0; i < solid.interior.words().size(); ++i) {
    solid.interior.words()[i] &= ~solid.boundary.words()[i];
  }
  return solid;
}

}  // namespace phantom::voxel
