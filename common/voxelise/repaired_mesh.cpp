#include "common/voxelise/repaired_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "common/geometry/mesh/weld.hpp"
#include "common/geometry/mesh/winding_number.hpp"

namespace phantom::voxelise::detail {
namespace {

geometry::TriangleMesh all_but(std::uint32_t shell, const geometry::TriangleMesh& mesh_W,
                               const RepairedMesh& repaired) {
  geometry::TriangleMesh mesh{mesh_W.vertices_m, {}};
  for (std::size_t i = 0; i < repaired.triangles.size(); ++i) {
    if (repaired.topology.shell_of[i] != shell) mesh.triangles.push_back(repaired.triangles[i]);
  }
  return mesh;
}

}  // namespace

RepairedMesh repair(const SnappedMesh& mesh) {
  const std::vector<std::uint32_t> first = geometry::weld(mesh.points);
  std::vector<Corners> joined;
  joined.reserve(mesh.triangles.size());
  for (const Corners& t : mesh.triangles) joined.push_back({first[t[0]], first[t[1]], first[t[2]]});
  geometry::UniqueTriangles unique = geometry::unique_triangles(joined);
  RepairedMesh repaired;
  repaired.degenerate = unique.degenerate;
  repaired.duplicates = unique.duplicates;
  repaired.triangles = std::move(unique.triangles);
  repaired.topology = geometry::topology_of(repaired.triangles);
  for (std::size_t i = 0; i < repaired.triangles.size(); ++i) {
    if (repaired.topology.turned[i] == 0) continue;
    std::swap(repaired.triangles[i][1], repaired.triangles[i][2]);
    ++repaired.turned;
  }
  repaired.closed = geometry::is_oriented_surface(repaired.triangles);
  return repaired;
}

bool turn_outer_shells(const geometry::TriangleMesh& mesh_W, RepairedMesh& repaired) {
  const auto& shells = repaired.topology.shells;
  std::vector<double> six_volumes(shells.size(), 0.0);
  std::vector<std::uint32_t> sample(shells.size(), 0);
  const Eigen::Vector3d origin = mesh_W.vertices_m.front().cast<double>();
  const auto corner = [&](std::size_t i, std::size_t k) -> Eigen::Vector3d {
    return mesh_W.vertices_m[repaired.triangles[i][k]].cast<double>() - origin;
  };
  for (std::uint32_t i = 0; i < repaired.triangles.size(); ++i) {
    six_volumes[repaired.topology.shell_of[i]] += corner(i, 0).dot(corner(i, 1).cross(corner(i, 2)));
    sample[repaired.topology.shell_of[i]] = i;
  }
  constexpr double kAffordable =
      2e8;  // triangles summed; above this, every inward shell is turned, because a solid is the safe choice
  const auto inward = std::count_if(six_volumes.begin(), six_volumes.end(), [](double v) { return v < 0; });
  const bool affordable =
      static_cast<double>(inward) * static_cast<double>(repaired.triangles.size()) < kAffordable;
  std::vector<std::uint8_t> turn(shells.size(), 0);
  for (std::uint32_t s = 0; s < shells.size(); ++s) {
    if (!shells[s].closed || !(six_volumes[s] < 0)) continue;
    const Eigen::Vector3d on_it =
        origin + (corner(sample[s], 0) + corner(sample[s], 1) + corner(sample[s], 2)) / 3.0;
    turn[s] = !affordable || geometry::winding_number(all_but(s, mesh_W, repaired), on_it) < 0.5 ? 1 : 0;
  }
  bool any = false;
  for (std::size_t i = 0; i < repaired.triangles.size(); ++i) {
    if (turn[repaired.topology.shell_of[i]] == 0) continue;
    std::swap(repaired.triangles[i][1], repaired.triangles[i][2]);
    ++repaired.turned;
    any = true;
  }
  return any;
}

}  // namespace phantom::voxelise::detail
