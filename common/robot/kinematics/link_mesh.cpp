#include "common/robot/kinematics/link_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "common/core/text.hpp"
#include "common/geometry/mesh/mesh_io.hpp"

namespace phantom::robot {
namespace {

bool is_collada(const std::filesystem::path& file) {
  return core::lower_case(file.extension().string()) == ".dae";
}

constexpr std::string_view kPackage = "package://";

}  // namespace

bool is_of_package(const std::string& name) { return name.starts_with(kPackage); }

bool lies_in_package(const std::filesystem::path& file, const std::string& name) {
  const std::string package = name.substr(kPackage.size(), name.find('/', kPackage.size()) - kPackage.size());
  return std::find(file.begin(), file.end(), package) != file.end();
}

std::filesystem::path find_mesh(const std::filesystem::path& folder, const std::string& name) {
  const std::string file = "file://";
  if (!is_of_package(name))  // an absolute name replaces the folder
    return (folder / (name.starts_with(file) ? name.substr(file.size()) : name)).lexically_normal();
  const std::string whole = name.substr(kPackage.size()), rest = whole.substr(whole.find('/') + 1);
  for (const std::string& relative : {whole, rest}) {
    std::filesystem::path place = std::filesystem::absolute(folder).lexically_normal();
    for (bool at_root = false; !at_root; place = place.parent_path()) {
      at_root = place == place.parent_path();
      if (std::filesystem::is_regular_file(place / relative)) return (place / relative).lexically_normal();
    }
  }
  return (folder / rest).lexically_normal();
}

core::Expected<geometry::TriangleMesh> load_mesh(const LinkMesh& mesh) {
  if (mesh.file.empty()) return mesh.body;
  geometry::MeshImportOptions options;
  options.y_up = false;
  Eigen::Vector3d scale = mesh.scale;
  if (!is_collada(mesh.file)) {
    options.scale = std::abs(scale.x());
    scale /= *options.scale;
  }
  auto loaded = geometry::load_mesh(mesh.file, options);
  if (!loaded) return loaded.status();
  geometry::TriangleMesh result = *std::move(loaded);
  if (scale == Eigen::Vector3d::Ones()) return result;
  for (Eigen::Vector3f& vertex_m : result.vertices_m)
    vertex_m = vertex_m.cast<double>().cwiseProduct(scale).cast<float>();
  if (!result.all_finite()) {
    return core::Status::invalid_argument(mesh.file.string() +
                                          ": its scale takes it beyond what a number of 32 bits can hold");
  }
  if (scale.prod() < 0.0) {  // mirrored: outward stays outward
    for (auto& triangle : result.triangles) std::swap(triangle[1], triangle[2]);
  }
  return result;
}

}  // namespace phantom::robot
