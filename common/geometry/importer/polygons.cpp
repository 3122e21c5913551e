#include "common/geometry/importer/polygons.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <numeric>

#include "common/geometry/mesh/mesh_import.hpp"
#include "common/geometry/mesh/vertex_welder.hpp"

namespace phantom::geometry::detail {
namespace {

/// Twice the area of a triangle in the plane; positive where it turns to the left.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The polygon seen against its normal (Newell's), so that it turns to the left.
std::vector<Eigen::Vector2d> flat(std::span<const Eigen::Vector3d> polygon) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d p = polygon[i] - polygon[0], q = polygon[(i + 1) % polygon.size()] - polygon[0];
    normal += p.cross(q);
  }
  Eigen::Index away = 0;
  normal.cwiseAbs().maxCoeff(&away);
  const Eigen::Index u = (away + 1) % 3, v = (away + 2) % 3;
  std::vector<Eigen::Vector2d> seen;
  seen.reserve(polygon.size());
  for (const Eigen::Vector3d& p : polygon)
    seen.push_back(normal[away] < 0.0 ? Eigen::Vector2d(p[v], p[u]) : Eigen::Vector2d(p[u], p[v]));
  return seen;
}

bool convex(const std::vector<Eigen::Vector2d>& seen) {
  const std::size_t n = seen.size();
  double turned_rad = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d in = seen[(i + 1) % n] - seen[i], out = seen[(i + 2) % n] - seen[(i + 1) % n];
    const double cross = in.x() * out.y() - in.y() * out.x();
    if (cross < 0.0) return false;
    turned_rad += std::atan2(cross, in.dot(out));
  }
  return turned_rad < 3 * M_PI;  // once around, not twice as a star
}

class EarCutter {
 public:
  explicit EarCutter(const std::vector<Eigen::Vector2d>& seen) : seen_(seen), left_(seen.size()) {
    std::iota(left_.begin(), left_.end(), 0U);
  }
  std::vector<std::array<std::uint32_t, 3>> cut() {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::size_t at = 0, tried = 0;
    while (left_.size() > 3) {
      at %= left_.size();
      // A polygon that crosses itself may have no ear: the next corner is cut off then.
      if (tried < left_.size() && !is_ear(at)) {
        ++at;
        ++tried;
        continue;
      }
      triangles.push_back({before(at), left_[at], after(at)});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(at));
      at = at == 0 ? left_.size() - 1 : at - 1;
      tried = 0;
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  std::uint32_t before(std::size_t at) const { return left_[(at + left_.size() - 1) % left_.size()]; }
  std::uint32_t after(std::size_t at) const { return left_[(at + 1) % left_.size()]; }
  bool is_ear(std::size_t at) const {
    const Eigen::Vector2d &a = seen_[before(at)], &b = seen_[left_[at]], &c = seen_[after(at)];
    if (turn(a, b, c) <= 0.0) return false;
    for (const std::uint32_t other : left_) {
      const Eigen::Vector2d& p = seen_[other];
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return false;
    }
    return true;
  }

  const std::vector<Eigen::Vector2d>& seen_;
  std::vector<std::uint32_t> left_;
};

std::string read_file(const std::filesystem::path& path) {
  std::error_code none;
  std::string bytes(std::filesystem::file_size(path, none), '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::array<double, 3> extents_of(const Polygons& polygons) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  for (const std::uint32_t corner : polygons.corners) {
    low = low.cwiseMin(polygons.vertices[corner]);
    high = high.cwiseMax(polygons.vertices[corner]);
  }
  const Eigen::Vector3d extent =
      polygons.corners.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(high - low);
  return {extent.x(), extent.y(), extent.z()};
}

bool finish_polygons(const Polygons& polygons, const char* format, const MeshImportOptions& options,
                     LoadedMesh& mesh, std::string& problem) {
  resolve_frame(
      options, format, {}, [&] { return extents_of(polygons); }, mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up);
  VertexWelder corners(mesh);
  std::uint64_t left = options.max_triangles, begin = 0;
  std::vector<Eigen::Vector3d> face;
  for (const std::uint64_t end : polygons.ends) {
    if (end - begin - 2 > left) {
      problem = too_many_triangles(options);
      return false;
    }
    left -= end - begin - 2;
    face.clear();
    for (std::uint64_t i = begin; i < end; ++i)
      face.push_back(to_metres * polygons.vertices[polygons.corners[i]]);
    for (const auto& [a, b, c] : triangulated(face)) {
      corners.triangle({corners.vertex(face[a].cast<float>()), corners.vertex(face[b].cast<float>()),
                        corners.vertex(face[c].cast<float>())});
    }
    begin = end;
  }
  return finish_import(corners.finite(), corners.collapsed(), mesh, problem);
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulated(std::span<const Eigen::Vector3d> polygon) {
  if (polygon.size() == 3) return {{0, 1, 2}};
  const std::vector<Eigen::Vector2d> seen = flat(polygon);
  if (!convex(seen)) return EarCutter(seen).cut();
  std::vector<std::array<std::uint32_t, 3>> fan;
  for (std::uint32_t i = 2; i < polygon.size(); ++i) fan.push_back({0, i - 1, i});
  return fan;
}

bool import_polygons(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                     std::string& problem) {
  const bool ply = extension_of(path) == "ply";
  try {
    const std::string bytes = read_file(path);
    if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
      throw UnreadableMesh("it is a text of 16 bits a character (UTF-16): save it as plain text");
    Polygons polygons = ply ? read_ply(bytes) : read_obj(bytes);
    mesh.notes = std::move(polygons.notes);
    return finish_polygons(polygons, ply ? "PLY" : "OBJ", options, mesh, problem);
  } catch (const UnreadableMesh& unreadable) {
    problem = std::string("is not a readable ") + (ply ? "PLY: " : "OBJ: ") + unreadable.what();
    return false;
  }
}

}  // namespace phantom::geometry::detail
