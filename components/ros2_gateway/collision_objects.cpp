#include "components/ros2_gateway/collision_objects.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/core/units.hpp"

namespace phantom::ros2_gateway {
namespace {

constexpr std::size_t kMaxName = 64, kMaxDescription = 16384;
constexpr double kMin_m = 1e-6, kMax_m = 1e4;

core::Status no_object(const std::string& what) { return core::Status::invalid_argument(what); }

std::string number(double value) { return core::formatted("%.9g", value); }

template <class List>
std::string list(const List& values) {
  return "[" + core::listed(values, number) + "]";
}

std::string pose(const geometry::Pose& X) {
  const Eigen::Matrix3d& R = X.rotation;
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const bool upright = std::hypot(R(0, 0), R(1, 0)) > 1e-9;  // else roll and yaw turn about the same axis
  const double roll = upright ? std::atan2(R(2, 1), R(2, 2)) : std::atan2(-R(1, 2), R(1, 1));
  const double yaw = upright ? std::atan2(R(1, 0), R(0, 0)) : 0.0;
  constexpr double kDegree = 1.0 / core::kRadPerDegree;
  return "{xyz_m: " + list(X.translation_m) +
         ", rpy_deg: " + list(std::array{roll * kDegree, pitch * kDegree, yaw * kDegree}) + "}";
}

core::Expected<std::string> shape(const CollisionObject::Solid& solid) {
  struct Kind {
    const char *name, *needs;
    std::size_t count;
  };
  static constexpr std::array<Kind, 5> kinds{{{"", "", 0},
                                              {"box", "x, y and z", 3},
                                              {"sphere", "a radius", 1},
                                              {"cylinder", "height and radius", 2},
                                              {"cone", "height and radius", 2}}};
  if (solid.type < 1 || solid.type >= static_cast<int>(kinds.size()))
    return no_object("a primitive of type " + std::to_string(solid.type) +
                     "; allowed: 1 box, 2 sphere, 3 cylinder, 4 cone; others as a mesh");
  const Kind& kind = kinds[static_cast<std::size_t>(solid.type)];
  const auto fits = [](double d) { return d >= kMin_m && d <= kMax_m; };
  if (solid.dimensions.size() != kind.count ||
      !std::all_of(solid.dimensions.begin(), solid.dimensions.end(), fits))
    return no_object("a " + std::string(kind.name) + " of dimensions " + list(solid.dimensions) +
                     "; allowed: " + kind.needs + ", each 1e-06 to 10000 m");
  const std::vector<double>& d = solid.dimensions;
  const std::string keys = solid.type == 1   ? "size_m: " + list(d)
                           : solid.type == 2 ? "radius_m: " + number(d[0])
                                             : "radius_m: " + number(d[1]) + ", height_m: " + number(d[0]);
  return "{" + std::string(kind.name) + ": {" + keys + "}, pose: " + pose(solid.X_OS) + "}";
}

core::Expected<std::string> polyhedron(const CollisionObject::Mesh& mesh) {
  if (mesh.vertices_m.size() < 4 || mesh.triangles.size() < 4)
    return no_object("a mesh of " + std::to_string(mesh.vertices_m.size()) + " vertices and " +
                     std::to_string(mesh.triangles.size()) +
                     " triangles; allowed: a solid, of at least 4 each");
  std::vector<double> vertices;
  std::vector<std::uint32_t> corners;
  for (const auto& vertex : mesh.vertices_m) {
    const Eigen::Vector3d p = mesh.X_OS * Eigen::Vector3d(vertex[0], vertex[1], vertex[2]);
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kMax_m)
      return no_object("a mesh with a vertex that is no number, or farther than 10000 m");
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z()});
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner >= mesh.vertices_m.size())
        return no_object("a mesh with a triangle at vertex " + std::to_string(corner) + " of " +
                         std::to_string(mesh.vertices_m.size()));
      corners.push_back(corner);
    }
  }
  return "{vertices_m: " + list(vertices) + ", triangles: " + list(corners) + "}";
}

core::Expected<std::string> solid_of(const CollisionObject& object) {
  const std::size_t count = object.solids.size() + object.meshes.size();
  if (object.planes) return no_object("a plane: it has no inside; allowed: primitives, or one mesh");
  if (count == 0) return no_object("no shape; allowed: primitives, or one mesh");
  if (count > kMaxShapes) return no_object(std::to_string(count) + " shapes; allowed: at most 32");
  if (!object.meshes.empty()) {
    if (count > 1) return no_object("a mesh beside other shapes; allowed: each as an object of its own");
    auto mesh = polyhedron(object.meshes.front());
    if (!mesh) return mesh;
    return "polyhedron: " + *mesh;
  }
  std::string shapes;
  for (const CollisionObject::Solid& solid : object.solids) {
    auto one = shape(solid);
    if (!one) return one;
    core::add_to_list(shapes, *one);
  }
  return "csg: {union: [" + shapes + "]}";
}

}  // namespace

core::Expected<geometry::Pose> pose_of(const std::array<double, 3>& position_m,
                                       const std::array<double, 4>& orientation_xyzw) {
  const Eigen::Vector3d p(position_m[0], position_m[1], position_m[2]);
  Eigen::Vector4d q(orientation_xyzw[0], orientation_xyzw[1], orientation_xyzw[2], orientation_xyzw[3]);
  if (q == Eigen::Vector4d::Zero()) q.w() = 1.0;
  if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kMax_m)
    return no_object("a position that is no number, or farther than 10000 m");
  if (!q.allFinite() || std::abs(q.norm() - 1.0) > 1e-3)
    return no_object("an orientation that is no unit quaternion");
  return geometry::Pose{geometry::rotation_from_quaternion(q), p};
}

core::Expected<std::vector<messages::WorkspaceCommand>> commands_of(const CollisionObject& object,
                                                                    const std::string& world) {
  const bool plain = std::all_of(object.id.begin(), object.id.end(), [](unsigned char c) {
    return c >= 0x20 && c != 0x7f && c != '"' && c != '\\';
  });
  if (object.id.empty() || object.id.size() > kMaxName || !plain)
    return no_object("an id of " + std::to_string(object.id.size()) +
                     " bytes; allowed: 1 to 64 in one line, without quotes and backslashes");
  messages::WorkspaceCommand remove{.operation = messages::WorkspaceOperation::kRemove, .object = object.id};
  if (object.operation == CollisionObject::kRemove) return std::vector{remove};
  if (object.frame != world)
    return no_object("given in frame '" + object.frame + "'; allowed: '" + world + "' (out.world)");
  if (object.operation == CollisionObject::kMove) {
    if (!object.solids.empty() || !object.meshes.empty() || object.planes)
      return no_object("MOVE with shapes; allowed: the pose alone, or ADD");
    return std::vector{messages::WorkspaceCommand{
        .operation = messages::WorkspaceOperation::kMove, .object = object.id, .X_WO = object.X_FO}};
  }
  if (object.operation != CollisionObject::kAdd)
    return no_object("operation " + std::to_string(object.operation) + "; allowed: ADD, REMOVE, MOVE");
  auto solid = solid_of(object);
  if (!solid) return solid.status();
  messages::WorkspaceCommand add{.operation = messages::WorkspaceOperation::kAdd};
  add.description = "name: \"" + object.id + "\"\n" + *solid + "\npose: " + pose(object.X_FO) + "\n";
  if (add.description.size() > kMaxDescription)
    return no_object("a mesh whose description takes " + std::to_string(add.description.size()) +
                     " bytes; allowed: 16384; a coarser one, or a file of the cell");
  return std::vector{remove, add};
}

}  // namespace phantom::ros2_gateway
