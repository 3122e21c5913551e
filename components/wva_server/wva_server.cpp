#include "components/wva_server/wva_server.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/core/errors.hpp"

namespace phantom::wva_server {

ActivatedCell activate(const voxel::GridSpec& grid, const std::vector<CellBody>& bodies,
                       std::uint64_t version, const voxel::Stopwatch& stopwatch,
                       const OnProgress& on_progress, const std::function<bool()>& go_on) {
  const double start_s = stopwatch();
  std::vector<voxel::LayerProfile> profiles;
  for (const CellBody& body : bodies) profiles.push_back(body.body.profile);
  auto activation = voxel::Activation::begin(grid, profiles, stopwatch);
  if (!activation) throw core::ConfigError(activation.status().message());
  ActivatedCell cell;
  for (const CellBody& body : bodies) {
    if (!go_on()) return cell;
    auto report = activation->add(body.body);
    if (!report) throw core::ConfigError("object " + report.status().message());
    cell.objects.push_back({body.body.name, body.body.id, body.mesh_O.vertices_m.size(), *report});
    on_progress(cell.objects.back(), cell.objects.size(), bodies.size());
  }
  auto workspace = std::make_shared<voxel::Workspace>(activation->take());
  workspace->version = version;
  cell.workspace = std::move(workspace);
  cell.build_s = stopwatch() - start_s;
  return cell;
}

std::string describe(const ActivatedObject& object) {
  const voxel::BodyReport& report = object.report;
  std::string text =
      fmt::format("{} (object {}): {} triangles, {} boundary and {} interior voxels, {:.0f} ms", object.name,
                  object.id, report.mesh.triangles, report.boundary_voxels, report.interior_voxels,
                  1e3 * (report.voxelise_s + report.layers_s + report.merge_s));
  if (report.mesh.duplicate_triangles > 0) {
    text += fmt::format("; {} triangles came twice and were left out", report.mesh.duplicate_triangles);
  }
  if (!report.mesh.closed) {
    text += fmt::format(
        "; the mesh is not closed: lines along three axes voted on what is inside ({} voxels disputed)",
        report.mesh.disputed_voxels);
  }
  return text;
}

}  // namespace phantom::wva_server
