#include "components/wva_server/wva_server.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/core/errors.hpp"
#include "common/voxel/merge.hpp"

namespace phantom::wva_server {
namespace {

void merge_all(const std::vector<runtime::CellBody>& bodies, const std::vector<voxel::ObjectBricks>& bricks,
               voxel::Workspace& workspace) {
  std::vector<voxel::CodeTable> codes;
  for (const runtime::CellBody& body : bodies) codes.push_back(voxel::code_table(body.body.profile, workspace.palette()));
  std::vector<voxel::MergeEntry> entries;
  for (std::size_t i = 0; i < bodies.size(); ++i) entries.push_back({&bricks[i], bodies[i].body.id, &codes[i]});
  voxel::merge_bricks(voxel::MergeLaw::kHighestViscosity, entries, voxel::keys_of(entries), workspace);
}

}  // namespace

ActivatedCell activate(const voxel::GridSpec& grid, const std::vector<runtime::CellBody>& bodies,
                       std::uint64_t version, const voxel::Stopwatch& stopwatch,
                       const OnProgress& on_progress, const std::function<bool()>& go_on) {
  const double start_s = stopwatch();
  std::vector<voxel::LayerProfile> profiles;
  for (const runtime::CellBody& body : bodies) profiles.push_back(body.body.profile);
  const auto palette = voxel::make_palette(profiles);
  if (!palette) throw core::ConfigError(palette.status().message());
  ActivatedCell cell;
  std::vector<voxel::ObjectBricks> bricks;
  voxel::ActivationOptions options;
  options.stopwatch = stopwatch;
  for (const runtime::CellBody& body : bodies) {
    if (!go_on()) return cell;
    auto activated = voxel::activate_object(body.body, grid, options);
    if (!activated) throw core::ConfigError("object " + activated.status().message());
    bricks.push_back(std::move(activated->bricks));
    cell.objects.push_back({body.body.name, body.body.id, body.mesh_O.vertices_m.size(), activated->report});
    on_progress(cell.objects.back(), cell.objects.size(), bodies.size());
  }
  const double merge_from_s = stopwatch();
  auto workspace = std::make_shared<voxel::Workspace>(grid, *palette);
  merge_all(bodies, bricks, *workspace);
  cell.merge_s = stopwatch() - merge_from_s;
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
                  1e3 * (report.voxelise_s + report.layers_s));
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
