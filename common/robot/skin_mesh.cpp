// Sensors all over a mesh: a maximal Poisson-disk set of surface points, each with the area nearest to it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "common/robot/skin_parts.hpp"

namespace phantom::robot::detail {
namespace {

using core::Status;

constexpr double kApart = 0.7;      // least distance of sensors, as a share of the pitch
constexpr double kPieceEdge = 0.3;  // longest edge of the pieces that are dealt out, likewise
constexpr double kMostPieces = 5e7;

/// A small piece of the surface.
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

/// Chosen points by cube of twice their least distance: all within that distance lie in eight cubes.
class Neighbours {
 public:
  explicit Neighbours(double apart_m) : apart_m_(apart_m) {}

  void add(const Eigen::Vector3d& p, std::size_t index) {
    const auto at = cell_of(p);
    cells_[key(at[0], at[1], at[2])].push_back({p, index});
  }

  /// Index of the nearest point closer than the least distance.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& p) const {
    const auto at = cell_of(p);
    std::array<std::int64_t, 3> other;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double share =
          p[static_cast<Eigen::Index>(axis)] / (2.0 * apart_m_) - static_cast<double>(at[axis]);
      other[axis] = at[axis] + (share < 0.5 ? -1 : 1);
    }
    std::optional<std::size_t> best;
    double best_square = apart_m_ * apart_m_;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const auto found = cells_.find(
          key(corner & 1 ? other[0] : at[0], corner & 2 ? other[1] : at[1], corner & 4 ? other[2] : at[2]));
      if (found == cells_.end()) continue;
      for (const auto& [point, index] : found->second) {
        const double square = (point - p).squaredNorm();
        if (square < best_square) best_square = square, best = index;
      }
    }
    return best;
  }

 private:
  std::array<std::int64_t, 3> cell_of(const Eigen::Vector3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / (2.0 * apart_m_))),
            static_cast<std::int64_t>(std::floor(p.y() / (2.0 * apart_m_))),
            static_cast<std::int64_t>(std::floor(p.z() / (2.0 * apart_m_)))};
  }
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::uint64_t mask = (1U << 21U) - 1U;
    return (static_cast<std::uint64_t>(x) & mask) << 42U | (static_cast<std::uint64_t>(y) & mask) << 21U |
           (static_cast<std::uint64_t>(z) & mask);
  }

  double apart_m_;
  std::unordered_map<std::uint64_t, std::vector<std::pair<Eigen::Vector3d, std::size_t>>> cells_;
};

/// A number that looks random and is the same everywhere (splitmix64).
std::uint64_t scrambled(std::uint64_t i) {
  i += 0x9e3779b97f4a7c15U;
  i = (i ^ (i >> 30U)) * 0xbf58476d1ce4e5b9U;
  i = (i ^ (i >> 27U)) * 0x94d049bb133111ebU;
  return i ^ (i >> 31U);
}

/// The pieces in an order without pattern.
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
  // Pieces are at most half a square of the edge and, cut in halves, seldom less than an eighth of it.
  if (area / (0.125 * edge_m * edge_m) + static_cast<double>(mesh.triangles.size()) > kMostPieces) {
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
  Neighbours chosen(kApart * pitch);
  for (const std::size_t i : shuffled(pieces->size())) {
    const Eigen::Vector3d& place = (*pieces)[i].centre_m;
    if (chosen.nearest(place)) continue;
    chosen.add(place, sensors.size());
    sensors.push_back({place, 0.0, mesh.gain, mesh.cluster});
    if (const auto fault = check_room(static_cast<double>(sensors.size()), rules)) return *fault;
  }
  for (const Piece& piece : *pieces) sensors[*chosen.nearest(piece.centre_m)].area_m2 += piece.area_m2;

  // Neighbours in space become neighbours in memory, which is what the sensing tick's cache wants.
  const auto cell = [&](const PlacedSensor& sensor) {
    const Eigen::Vector3d at = (sensor.position_m / (8.0 * rules.voxel_m)).array().floor();
    return std::tuple(at.z(), at.y(), at.x());
  };
  std::stable_sort(sensors.begin(), sensors.end(),
                   [&](const PlacedSensor& a, const PlacedSensor& b) { return cell(a) < cell(b); });
  return sensors;
}

}  // namespace phantom::robot::detail
