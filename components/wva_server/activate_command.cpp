#include "components/wva_server/activate_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <sstream>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/voxel/nrrd.hpp"
#include "components/wva_server/pose_text.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {
namespace {

using core::ConfigError;
using nlohmann::json;

double stopwatch_s() { return core::seconds(core::monotonic_ns()); }

ConfigError wrong(const std::string& option, const std::string& problem) {
  return ConfigError("activate: " + option + ": " + problem);
}

geometry::Pose pose_of(const std::string& text) {
  const auto pose = parse_pose(text);
  if (!pose) throw wrong("--pose", pose.status().message());
  return *pose;
}

void check_method(const ActivateRequest& request) {
  if (request.method != "distance") {
    throw wrong("--method", "'" + request.method + "' is not available in this version; allowed: distance");
  }
  if (!request.element.empty()) {
    throw wrong(
        "--element",
        "belongs to the dilation method, which is not available in this version; allowed: leave it out");
  }
  if (request.inside != 0) {
    throw wrong("--inside", std::to_string(request.inside) +
                                ": layers inside the body are not available in this version; allowed: 0");
  }
}

void check_combination(const ActivateRequest& request) {
  if (request.mesh.empty() == request.cell.empty())
    throw wrong("--mesh, --cell", "exactly one of them must be given");
  check_method(request);
  if (!request.cell.empty()) {
    const bool mesh_only = request.scale != 0 || request.fit_extent_m != 0 || !request.pose.empty() ||
                           request.voxel_size_m != 0 || !request.layers.empty() || !request.mu.empty() ||
                           request.mu_skin != 0 || request.guard != 0 || request.up_axis != "z";
    if (mesh_only) {
      throw wrong(
          "--cell",
          "the cell file says scale, up-axis, poses, voxel size, layers, viscosities and guards; allowed "
          "beside it: --method, --export, --field, --encoding");
    }
    return;
  }
  if (request.voxel_size_m == 0) throw wrong("--voxel-size-m", "is missing; a mesh needs it");
  if (request.layers.empty() || request.mu.empty())
    throw wrong("--layers, --mu", "are missing; a mesh needs both");
  if (request.scale != 0 && request.fit_extent_m != 0)
    throw wrong("--scale, --fit-extent-m", "only one of them may be given");
}

voxel::LayerProfile profile_of(const ActivateRequest& request) {
  voxel::LayerProfile profile;
  profile.thickness_vox = request.layers;
  profile.mu_Pa_s_per_m.assign(request.mu.begin(), request.mu.end());
  const double steepest = *std::max_element(request.mu.begin(), request.mu.end());
  profile.mu_skin_Pa_s_per_m =
      static_cast<float>(request.mu_skin != 0 ? request.mu_skin : std::max(100.0, steepest));
  profile.guard_vox = request.guard;
  if (const auto checked = voxel::check_profile(profile); !checked) {
    throw wrong("--layers, --mu, --mu-skin, --guard", checked.message());
  }
  return profile;
}

/// What both forms of the command end with.
struct Outcome {
  voxel::Workspace workspace;
  json objects = json::array();
  double load_s = 0.0, voxelise_s = 0.0, layers_s = 0.0, merge_s = 0.0;

  void add(const std::string& name, std::uint16_t id, std::size_t vertices, const voxel::BodyReport& report) {
    objects.push_back({{"id", id},
                       {"name", name},
                       {"vertices", vertices},
                       {"triangles", report.mesh.triangles},
                       {"duplicate_triangles", report.mesh.duplicate_triangles},
                       {"closed", report.mesh.closed},
                       {"disputed_voxels", report.mesh.disputed_voxels},
                       {"boundary_voxels", report.boundary_voxels},
                       {"interior_voxels", report.interior_voxels}});
    voxelise_s += report.voxelise_s;
    layers_s += report.layers_s;
  }
};

Outcome activate_mesh(const ActivateRequest& request, const WvaServerConfig& config) {
  Outcome outcome;
  const voxel::LayerProfile profile = profile_of(request);
  const geometry::Pose X_WO = request.pose.empty() ? geometry::Pose{} : pose_of(request.pose);
  const double start_s = stopwatch_s();
  geometry::MeshImportOptions options = config.mesh_import;
  options.scale = request.scale == 0 ? 1.0 : request.scale;
  options.y_up = request.up_axis == "y";
  auto mesh = geometry::load_mesh(request.mesh, options);
  if (!mesh) {
    if (mesh.status().code() == core::ErrorCode::kNotFound) throw core::MissingError(mesh.status().message());
    throw ConfigError(mesh.status().message());
  }
  if (request.fit_extent_m != 0) {
    const geometry::BoundingBox box = mesh->bounding_box();
    const float extent = (box.max_m - box.min_m).maxCoeff();
    if (!(extent > 0)) throw wrong("--fit-extent-m", "the mesh has no extent");
    for (auto& vertex : mesh->vertices_m) vertex *= static_cast<float>(request.fit_extent_m) / extent;
  }
  outcome.load_s = stopwatch_s() - start_s;
  const std::size_t vertices = mesh->vertices_m.size();
  const voxel::Body body{std::filesystem::path(request.mesh).filename().string(), 1, mesh->transformed(X_WO),
                         profile};
  voxel::ActivationOptions activation;
  activation.stopwatch = stopwatch_s;
  auto activated = voxel::activate_alone(body, request.voxel_size_m, activation);
  if (!activated) throw ConfigError("activate: " + activated.status().message());
  outcome.workspace = std::move(activated->first);
  outcome.add(body.name, 1, vertices, activated->second);
  return outcome;
}

Outcome activate_cell(const ActivateRequest& request, const WvaServerConfig& config) {
  Outcome outcome;
  const auto cell = runtime::load_cell(request.cell);
  const double start_s = stopwatch_s();
  auto bodies = runtime::load_bodies(cell, config.mesh_import);
  outcome.load_s = stopwatch_s() - start_s;
  LiveCell live(cell, config.mesh_import);
  const auto change = live.activate(std::move(bodies), 1, {.stopwatch = stopwatch_s}, [](const auto&...) {});
  if (!change) throw ConfigError("object " + change.status().message());
  outcome.merge_s = change->merge_s;
  for (const auto& [id, object] : live.objects())
    outcome.add(object.config.name, id, object.mesh_O.vertices_m.size(), object.report);
  outcome.workspace = std::move(live).take_workspace();
  return outcome;
}

json voxel_counts(const voxel::Workspace& workspace) {
  json counts = json::object();
  const auto by_order = voxel::count_orders(workspace);
  for (std::size_t order = 0; order < by_order.size(); ++order) {
    if (by_order[order] != 0)
      counts[std::to_string(static_cast<int>(static_cast<std::int8_t>(order)))] = by_order[order];
  }
  return counts;
}

voxel::NrrdField field_of(const std::string& name) {
  return name == "mu"       ? voxel::NrrdField::kMu
         : name == "object" ? voxel::NrrdField::kObject
                            : voxel::NrrdField::kOrder;
}

}  // namespace

void add_options(CLI::App& command, ActivateRequest& request) {
  command.add_option("--mesh", request.mesh, "mesh file to activate (STL, OBJ, PLY, OFF, glTF, COLLADA, …)");
  command.add_option("--cell", request.cell, "cell file to activate as a whole, instead of a mesh");
  command
      .add_option("--scale", request.scale,
                  "metres per unit of the mesh file, e.g. 0.001 for millimetres; default 1")
      ->check(CLI::Range(1e-9, 1e9));
  command
      .add_option("--fit-extent-m", request.fit_extent_m,
                  "scale the mesh so that its longest side has this length")
      ->check(CLI::Range(1e-6, 1e6));
  command.add_option("--up-axis", request.up_axis, "axis of the mesh file that points up")
      ->check(CLI::IsMember({"z", "y"}));
  command.add_option("--pose", request.pose, "\"x y z roll pitch yaw\" of the mesh in W, metres and degrees");
  command.add_option("--voxel-size-m", request.voxel_size_m, "edge of a voxel")->check(CLI::Range(1e-6, 1e3));
  command
      .add_option("--layers", request.layers,
                  "thickness of each layer in voxels, the nearest first: 4,4,4,4,4,4")
      ->delimiter(',');
  command
      .add_option("--mu", request.mu, "viscosity of each layer in Pa·s/m, falling outwards: 32,20,13,11,10,9")
      ->delimiter(',');
  command
      .add_option("--mu-skin", request.mu_skin,
                  "viscosity of the body itself; default 100, or the first layer's if higher")
      ->check(CLI::Range(1e-6, 1e6));
  command.add_option("--method", request.method, "how layers are made: distance, exact")
      ->check(CLI::IsMember({"distance", "surface", "dilation"}));
  command.add_option("--element", request.element, "shaping element of the dilation method")
      ->check(CLI::IsMember({"cube", "sphere", "sphere-contained"}));
  command.add_option("--guard", request.guard, "thickness in voxels of a protective skin around the body")
      ->check(CLI::Range(0, 254));
  command.add_option("--inside", request.inside, "layers inside the body")->check(CLI::Range(0, 98));
  command.add_option("--export", request.out, "NRRD file to write")->required();
  command.add_option("--field", request.field, "what to write per voxel")
      ->check(CLI::IsMember({"order", "mu", "object"}));
  command.add_option("--encoding", request.encoding, "of the NRRD file")
      ->check(CLI::IsMember({"gzip", "raw"}));
}

int run_activate(const ActivateRequest& request, const WvaServerConfig& config, std::ostream& print) {
  check_combination(request);
  const double start_s = stopwatch_s();
  const Outcome outcome =
      request.cell.empty() ? activate_mesh(request, config) : activate_cell(request, config);
  const double export_from_s = stopwatch_s();
  const auto encoding = request.encoding == "raw" ? voxel::NrrdEncoding::kRaw : voxel::NrrdEncoding::kGzip;
  if (const auto written =
          voxel::write_nrrd(request.out, outcome.workspace, field_of(request.field), encoding);
      !written) {
    throw ConfigError("activate: --export: " + written.message());
  }
  const double end_s = stopwatch_s();
  const voxel::GridSpec& grid = outcome.workspace.grid();
  const json line = {{"size_vox", grid.size_vox},
                     {"voxel_size_m", grid.voxel_size_m},
                     {"origin_m", {grid.origin_m.x(), grid.origin_m.y(), grid.origin_m.z()}},
                     {"method", request.method},
                     {"field", request.field},
                     {"voxels", voxel_counts(outcome.workspace)},
                     {"objects", outcome.objects},
                     {"bricks", outcome.workspace.brick_count()},
                     {"bytes", outcome.workspace.bytes()},
                     {"seconds",
                      {{"load", outcome.load_s},
                       {"voxelise", outcome.voxelise_s},
                       {"layers", outcome.layers_s},
                       {"merge", outcome.merge_s},
                       {"export", end_s - export_from_s},
                       {"total", end_s - start_s}}},
                     {"export", request.out}};
  print << line.dump() << std::endl;
  return 0;
}

}  // namespace phantom::wva_server
