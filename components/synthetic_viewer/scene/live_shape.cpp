#include "components/synthetic_viewer/scene/live_shape.hpp"

#include <array>

#include "common/messages/living.hpp"
#include "common/workspace/fluid_shape.hpp"

namespace phantom::synthetic_viewer {
namespace {

void append_face(const workspace::GridSpec& grid, const workspace::ShellFace& face,
                 geometry::TriangleMesh& mesh) {
  const std::size_t axis = face.side / 2U, along = (axis + 1) % 3, across = (axis + 2) % 3;
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  constexpr std::array<std::array<int, 2>, 4> kCorners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};  // anticlockwise
  for (const auto& [u, v] : kCorners) {
    std::array<double, 3> corner{};
    for (std::size_t i = 0; i < 3; ++i) corner[i] = face.corner[i];
    corner[along] += u * face.size[0];
    corner[across] += v * face.size[1];
    const Eigen::Vector3d corner_vox(corner[0], corner[1], corner[2]);
    mesh.vertices_m.push_back(
        (grid.origin_m + grid.voxel_size_m.sides_m().cwiseProduct(corner_vox)).cast<float>());
  }
  const bool down = face.side % 2 != 0;
  mesh.triangles.push_back(down ? std::array{first, first + 2, first + 1}
                                : std::array{first, first + 1, first + 2});
  mesh.triangles.push_back(down ? std::array{first, first + 3, first + 2}
                                : std::array{first, first + 2, first + 3});
}

}  // namespace

LiveShapes live_shapes(const workspace::Workspace& workspace) {
  LiveShapes shapes;
  std::size_t left = kMaxLiveFaces;
  for (const workspace::ObjectFluid& fluid : workspace::fluids_of(workspace)) {
    if (!messages::is_live(fluid.object)) continue;
    const auto faces =
        workspace::shell_of(workspace, fluid.box, fluid.object, workspace::kOrderBoundary, left);
    if (!faces || faces->empty()) continue;
    left -= faces->size();
    geometry::TriangleMesh& mesh = shapes[fluid.object];
    for (const workspace::ShellFace& face : *faces) append_face(workspace.grid(), face, mesh);
  }
  return shapes;
}

}  // namespace phantom::synthetic_viewer
