#include "components/workspace_survey/object_text.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/runtime/configuration/pose_text.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr std::size_t kDescriptionBound = 16384;  // bytes; bound in the IDL

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

std::string pose_yaml(const geometry::Pose& X_WO) {
  std::istringstream numbers(runtime::pose_text(X_WO));
  std::array<std::string, 6> n;
  for (std::string& number : n) numbers >> number;
  return fmt::format("{{xyz_m: [{}, {}, {}], rpy_deg: [{}, {}, {}]}}", n[0], n[1], n[2], n[3], n[4], n[5]);
}

std::string polyhedron_yaml(const geometry::TriangleMesh& mesh) {
  std::string vertices, triangles;
  for (const Eigen::Vector3f& v : mesh.vertices_m)
    vertices += fmt::format("{}{:.7g},{:.7g},{:.7g}", vertices.empty() ? "" : ",", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles)
    triangles += fmt::format("{}{},{},{}", triangles.empty() ? "" : ",", t[0], t[1], t[2]);
  return "{vertices_m: [" + vertices + "], triangles: [" + triangles + "]}";
}

}  // namespace

std::string object_text(const LibraryPart& part, const survey::PartModel& model, const std::string& name,
                        const geometry::Pose& X_WO, int guard_vox) {
  std::string text = "name: " + quoted(name) + "\n";
  if (part.cell_mesh.empty()) {
    text += "polyhedron: " + polyhedron_yaml(model.mesh_O) + "\n";
  } else {
    text += fmt::format("mesh: {}\nmesh_scale: {}\nup_axis: {}\n", quoted(part.cell_mesh),
                        part.import.scale.value_or(1.0), part.import.y_up.value_or(false) ? "y" : "z");
  }
  text +=
      "pose: " + pose_yaml(X_WO) + fmt::format("\nguard_vox: {}\ncolour: [0.20, 0.35, 0.60]\n", guard_vox);
  if (text.size() > kDescriptionBound) {
    throw core::ConfigError(fmt::format(
        "part '{}': its mesh of {} triangles is too large to travel with a command ({} bytes; "
        "allowed: {}); put it into the cell's folder, and its file's name as cell_mesh into library.yaml",
        part.name, model.mesh_O.triangles.size(), text.size(), kDescriptionBound));
  }
  return text;
}

}  // namespace phantom::workspace_survey
