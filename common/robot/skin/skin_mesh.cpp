// Sensors all over a mesh: a maximal Poisson-disk set of surface points. Each gets the area nearest to it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/geometry/mesh/weld.hpp"
#include "common/robot/skin/skin_parts.hpp"

namespace phantom::robot::detail {
namespace {

using core::Status;

constexpr double kApart = 0.7;      // least distance between sensors, as a share of the pitch
constexpr double kPieceEdge = 0.3;  // longest edge of the surface pieces, as a share of the pitch
constexpr double kMaxPieces = 5e7;

struct Piece {
  Eigen::Vector3d centre_m;
  double area_m2;
};

/// Cuts a triangle along its longest edge until no edge is longer than `edge_m`.
void cut(const std::array<Eigen::Vector3d, 3>& triangle, double edge_m, std::vector<Piece>& pieces) {
  std::vector<std::array<Eigen::Vector3d, 3>> rest{triangle};
  while (!rest.empty()) {
    const auto [a, b, c] = rest.back();
    rest.pop_back();
    const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
    const double longest = std::max({ab, bc, ca});
    if (longest <= edge_m * edge_m) {
      const double area = 0.5 * (b - a).cross(c - a).norm();
      if (area > 0.0) pieces.push_back({(a + b + c) / 3.0, area});
      continue;
    }
    const auto halve = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& apex) {
      const Eigen::Vector3d middle = 0.5 * (p + q);
      rest.push_back({p, middle, apex});
      rest.push_back({middle, q, apex});
    };
    if (longest == ab) {
      halve(a, b, c);
    } else if (longest == bc) {
      halve(b, c, a);
    } else {
      halve(c, a, b);
    }
  }
}

/// Returns a pseudo-random number that is the same on every machine (splitmix64).
std::uint64_t scrambled(std::uint64_t i) {
  i += 0x9e3779b97f4a7c15U;
  i = (i ^ (i >> 30U)) * 0xbf58476d1ce4e5b9U;
  i = (i ^ (i >> 27U)) * 0x94d049bb133111ebU;
  return i ^ (i >> 31U);
}

/// Returns the pieces' indices in pseudo-random order.
std::vector<std::size_t> shuffled(std::size_t count) {
  std::vector<std::pair<std::uint64_t, std::size_t>> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = {scrambled(i), i};
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> indices(count);
  std::transform(order.begin(), order.end(), indices.begin(), [](const auto& entry) { return entry.second; });
  return indices;
}

core::Expected<std::vector<Piece>> pieces_of(const geometry::TriangleMesh& mesh, double edge_m) {
  double area = 0.0;
  const auto corner = [&](std::uint32_t vertex) -> Eigen::Vector3d {
    return mesh.vertices_m[vertex].cast<double>();
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    if (std::max({a, b, c}) >= mesh.vertices_m.size() || !corner(a).allFinite() || !corner(b).allFinite() ||
        !corner(c).allFinite()) {
      return Status::invalid_argument("a triangle has a vertex that is missing or not finite");
    }
    area += 0.5 * (corner(b) - corner(a)).cross(corner(c) - corner(a)).norm();
  }
  if (!(area > 0.0)) return Status::invalid_argument("has no surface");
  // A piece's area is at most half of edge_m². Pieces come from halving, so it is seldom less than an eighth
  // of it.
  if (area / (0.125 * edge_m * edge_m) + static_cast<double>(mesh.triangles.size()) > kMaxPieces) {
    return Status::invalid_argument("its surface of " + std::to_string(area) +
                                    " m² is too large for the pitch; widen the pitch");
  }
  std::vector<Piece> pieces;
  for (const auto& [a, b, c] : mesh.triangles) cut({corner(a), corner(b), corner(c)}, edge_m, pieces);
  return pieces;
}

}  // namespace

core::Expected<std::vector<PlacedSensor>> sensors_of(const MeshSensors& mesh, const PartRules& rules) {
  if (const std::string fault = check_sensor(mesh.gain, mesh.cluster); !fault.empty())
    return Status::invalid_argument(fault);
  const double pitch = rules.pitch_of(mesh.cluster);
  const auto pieces = pieces_of(mesh.mesh_m, kPieceEdge * pitch);
  if (!pieces) return pieces.status();

  std::vector<PlacedSensor> sensors;
  const double apart_m = kApart * pitch;
  geometry::PointGrid chosen(apart_m);
  for (const std::size_t i : shuffled(pieces->size())) {
    const Eigen::Vector3d& place = (*pieces)[i].centre_m;
    if (const auto near = chosen.nearest(place); near && near->square_m2 < apart_m * apart_m) continue;
    chosen.add(place, static_cast<std::uint32_t>(sensors.size()));
    sensors.push_back({place, 0.0, mesh.gain, mesh.cluster});
    if (const auto fault = check_capacity(static_cast<double>(sensors.size()), rules)) return *fault;
  }
  for (const Piece& piece : *pieces) sensors[chosen.nearest(piece.centre_m)->index].area_m2 += piece.area_m2;

  // Sorting by cell makes neighbours in space neighbours in memory, which suits the cache in the sensing
  // tick.
  const auto cell = [&](const PlacedSensor& sensor) {
    const Eigen::Vector3d at = (sensor.position_m / (8.0 * rules.voxel_m)).array().floor();
    return std::tuple(at.z(), at.y(), at.x());
  };
  std::stable_sort(sensors.begin(), sensors.end(),
                   [&](const PlacedSensor& a, const PlacedSensor& b) { return cell(a) < cell(b); });
  return sensors;
}

}  // namespace phantom::robot::detail
