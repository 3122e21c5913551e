#include "components/wva_server/activate_command.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/geometry/mesh/mesh_report.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/pose_text.hpp"
#include "common/runtime/process/process.hpp"
#include "common/workspace/nrrd.hpp"
#include "common/workspace/thin_layers.hpp"
#include "components/wva_server/fidelity_report.hpp"
#include "components/wva_server/progress_bar.hpp"
#include "components/wva_server/slice_picture.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {
namespace {

using core::ConfigError;
using nlohmann::json;

double stopwatch_s() { return core::seconds(core::monotonic_ns()); }

geometry::Pose pose_of(const std::string& text) {
  const auto pose = runtime::parse_pose(text);
  if (!pose) throw wrong_option("--pose", pose.status().message());
  return *pose;
}

json report_of(const geometry::MeshReport& mesh) {
  return {{"degenerate_triangles", mesh.degenerate_triangles},
          {"duplicate_triangles", mesh.duplicate_triangles},
          {"open_edges", mesh.open_edges},
          {"non_manifold_edges", mesh.non_manifold_edges},
          {"flipped_triangles", mesh.flipped_triangles},
          {"shells", mesh.shells},
          {"closed_shells", mesh.closed_shells},
          {"inward_shells", mesh.inward_shells},
          {"intersecting_pairs", mesh.intersecting_pairs},
          {"intersections_complete", mesh.intersections_complete},
          {"area_m2", mesh.area_m2},
          {"volume_m3", mesh.has_volume() ? json(mesh.volume_m3) : json()}};
}

/// The outcome of activating a mesh or a cell.
struct Activated {
  workspace::Workspace workspace;
  PictureText picture;
  std::vector<layers::LayerFidelity> fidelity;  // empty unless requested
  FidelityHead fidelity_head;
  json objects = json::array();
  std::string method;
  double load_s = 0.0, inspect_s = 0.0, voxelise_s = 0.0, layers_s = 0.0, merge_s = 0.0, fidelity_s = 0.0;

  void add(const std::string& name, std::uint16_t id, const geometry::TriangleMesh& mesh,
           const workspace::LayerProfile& profile, std::vector<std::string> notes,
           const layers::BodyReport& report, bool by_formula = false) {
    json inspected;  // null for a solid by formula: its mesh is only for display
    if (!by_formula) {
      const double start_s = stopwatch_s();
      const geometry::MeshReport found = geometry::inspect_mesh(mesh);
      inspect_s += stopwatch_s() - start_s;
      for (const std::string& defect : geometry::describe(found)) notes.push_back("the mesh " + defect);
      inspected = report_of(found);
    }
    for (const std::string& note : notes) spdlog::warn("{}: {}", name, note);
    objects.push_back({{"id", id},
                       {"name", name},
                       {"vertices", mesh.vertices_m.size()},
                       {"triangles", mesh.triangles.size()},
                       {"method", method_text(profile)},
                       {"mesh", inspected},
                       {"warnings", notes},
                       {"closed", report.mesh.closed},
                       {"disputed_voxels", report.mesh.disputed_voxels},
                       {"boundary_voxels", report.boundary_voxels},
                       {"interior_voxels", report.interior_voxels}});
    voxelise_s += report.voxelise_s;
    layers_s += report.layers_s;
    if (method.empty()) method = method_text(profile);
    if (method != method_text(profile)) method = "mixed";
  }
};

[[noreturn]] void refuse(const core::Status& status) {
  if (status.code() == core::ErrorCode::kUnavailable)
    throw std::runtime_error("activate: " + status.message());
  throw ConfigError("activate: " + status.message());
}

/// Returns "32 Pa s/m" per layer, for a picture's legend.
std::vector<std::string> notes_of(const workspace::LayerProfile& profile) {
  std::vector<std::string> notes;
  for (const float mu : profile.mu_Pa_s_per_m) notes.push_back(core::formatted("%g Pa s/m", mu));
  return notes;
}

geometry::LoadedMesh load(const ActivateRequest& request, const WvaServerConfig& config) {
  geometry::MeshImportOptions options = config.mesh_import;
  if (request.scale != 0) options.scale = request.scale;
  if (request.fit_extent_m != 0) options.scale = 1.0;  // the mesh is rescaled below: its unit does not matter
  if (!request.up_axis.empty()) options.y_up = request.up_axis == "y";
  auto mesh = geometry::load_mesh(request.mesh, options);
  if (!mesh) {
    if (mesh.status().code() == core::ErrorCode::kNotFound) throw core::MissingError(mesh.status().message());
    throw ConfigError(mesh.status().message());
  }
  if (request.fit_extent_m == 0) return std::move(*mesh);
  const geometry::BoundingBox box = mesh->bounding_box();
  const float extent = (box.max_m - box.min_m).maxCoeff();
  if (!(extent > 0)) throw wrong_option("--fit-extent-m", "the mesh has no extent");
  for (auto& vertex : mesh->vertices_m) vertex *= static_cast<float>(request.fit_extent_m) / extent;
  return std::move(*mesh);
}

layers::ActivationOptions activation_options(const ActivateRequest& request, const WvaServerConfig& config) {
  layers::ActivationOptions options;
  options.threads = request.threads != 0 ? request.threads : config.threads;
  options.stopwatch = stopwatch_s;
  options.keep_going = [] { return !runtime::stop_requested(); };
  return options;
}

Activated activate_mesh(const ActivateRequest& request, const WvaServerConfig& config) {
  Activated outcome;
  const workspace::LayerProfile profile = profile_of(request);
  const geometry::Pose X_WO = request.pose.empty() ? geometry::Pose{} : pose_of(request.pose);
  const double start_s = stopwatch_s();
  geometry::LoadedMesh mesh = load(request, config);
  const double voxel_m = voxel_size_of(request).sides_m().minCoeff();
  const geometry::CoordinatePrecision precision = geometry::coordinate_precision(mesh);
  if (precision.is_useless(voxel_m))
    throw ConfigError(request.mesh + ": " + geometry::describe(precision, voxel_m));
  if (precision.is_coarse(voxel_m)) mesh.notes.push_back(geometry::describe(precision, voxel_m));
  if (const auto checked = workspace::check_layers(profile, voxel_size_of(request)); !checked)
    throw ConfigError("activate: --layers: " + checked.message());
  for (std::string& note : workspace::thin_layer_notes(profile, voxel_size_of(request)))
    mesh.notes.push_back("the profile's " + std::move(note));
  outcome.load_s = stopwatch_s() - start_s;
  const layers::Body body{std::filesystem::path(request.mesh).filename().string(), 1, mesh.transformed(X_WO),
                          profile};
  ProgressBar bar(body.name);
  layers::ActivationOptions options = activation_options(request, config);
  options.on_progress = [&](double share) { bar.show(share); };
  auto activated = layers::activate_alone(body, voxel_size_of(request), options);
  if (!activated) refuse(activated.status());
  outcome.workspace = std::move(activated->first);
  outcome.add(body.name, 1, mesh, profile, mesh.notes, activated->second);
  outcome.picture = {body.name + ", " + method_text(profile), notes_of(profile)};
  if (!request.fidelity.empty()) {
    const double from_s = stopwatch_s();
    outcome.fidelity = layers::measure_fidelity(body.mesh_W, profile, outcome.workspace, options.threads);
    outcome.fidelity_head = {body.name, method_text(profile), voxel_size_of(request), profile.thickness_vox,
                             profile.guard_vox};
    outcome.fidelity_s = stopwatch_s() - from_s;
  }
  return outcome;
}

Activated activate_cell(const ActivateRequest& request, const WvaServerConfig& config) {
  Activated outcome;
  const auto cell = runtime::load_checked_cell(request.cell, runtime::CellArms::kOptional);
  const double start_s = stopwatch_s();
  auto bodies = runtime::load_bodies(cell, config.mesh_import);
  for (runtime::CellBody& body : bodies) apply_method(request, body.body.profile);
  outcome.load_s = stopwatch_s() - start_s;
  std::vector<workspace::LayerProfile> profiles;
  for (const runtime::CellBody& body : bodies) profiles.push_back(body.body.profile);
  ProgressBar bar(cell.name);
  std::size_t done = 0;
  layers::ActivationOptions options = activation_options(request, config);
  options.on_progress = [&](double share) {
    bar.show((static_cast<double>(done) + share) / static_cast<double>(profiles.size()));
  };
  LiveCell live(cell, {});
  const auto change =
      live.activate(std::move(bodies), 1, options, [&](const auto&, std::size_t now) { done = now; });
  if (!change) refuse({change.status().code(), "object " + change.status().message()});
  outcome.merge_s = change->merge_s;
  std::size_t i = 0;
  for (const auto& [id, object] : live.objects())
    outcome.add(object.config.name, id, object.mesh_O, profiles[i++], object.notes, object.report,
                object.config.solid_O != nullptr);
  outcome.picture.title = cell.name + ", " + outcome.method;
  outcome.workspace = std::move(live).take_workspace();
  return outcome;
}

json voxel_counts(const workspace::Workspace& workspace) {
  json counts = json::object();
  const auto by_order = layers::count_orders(workspace);
  for (std::size_t order = 0; order < by_order.size(); ++order) {
    if (by_order[order] != 0)
      counts[std::to_string(static_cast<int>(static_cast<std::int8_t>(order)))] = by_order[order];
  }
  return counts;
}

void write_file(const std::string& option, const std::string& path, const char* bytes, std::size_t size) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes, static_cast<std::streamsize>(size));
  file.close();
  if (!file) throw wrong_option(option, path + ": cannot be written");
}

/// Writes the picture and the fidelity report, where requested.
void write_extras(const ActivateRequest& request, const Activated& outcome) {
  if (!request.picture.empty()) {
    const auto png = slice_picture(outcome.workspace, outcome.picture);
    write_file("--picture", request.picture, reinterpret_cast<const char*>(png.data()), png.size());
  }
  if (!request.fidelity.empty()) {
    const std::string text = request.fidelity.ends_with(".json")
                                 ? fidelity_json(outcome.fidelity_head, outcome.fidelity)
                                 : fidelity_csv(outcome.fidelity_head, outcome.fidelity);
    write_file("--fidelity", request.fidelity, text.data(), text.size());
  }
}

int activate_and_write(const ActivateRequest& request, const WvaServerConfig& config, std::ostream& print) {
  const double start_s = stopwatch_s();
  const Activated outcome =
      request.cell.empty() ? activate_mesh(request, config) : activate_cell(request, config);
  const double export_from_s = stopwatch_s();
  const auto encoding =
      request.encoding == "raw" ? workspace::NrrdEncoding::kRaw : workspace::NrrdEncoding::kGzip;
  if (const auto written =
          workspace::write_nrrd(request.out, outcome.workspace, field_of(request.field), encoding);
      !written) {
    throw wrong_option("--export", written.message());
  }
  write_extras(request, outcome);
  const double end_s = stopwatch_s();
  const workspace::GridSpec& grid = outcome.workspace.grid();
  const json line = {{"size_vox", grid.size_vox},
                     {"voxel_size_m", sides_json(grid.voxel_size_m)},
                     {"origin_m", {grid.origin_m.x(), grid.origin_m.y(), grid.origin_m.z()}},
                     {"method", outcome.method},
                     {"field", request.field},
                     {"voxels", voxel_counts(outcome.workspace)},
                     {"objects", outcome.objects},
                     {"bricks", outcome.workspace.brick_count()},
                     {"bytes", outcome.workspace.bytes()},
                     {"seconds",
                      {{"load", outcome.load_s},
                       {"inspect", outcome.inspect_s},
                       {"voxelise", outcome.voxelise_s},
                       {"layers", outcome.layers_s},
                       {"merge", outcome.merge_s},
                       {"fidelity", outcome.fidelity_s},
                       {"export", end_s - export_from_s},
                       {"total", end_s - start_s}}},
                     {"export", request.out}};
  // File names need not be UTF-8, but JSON must be.
  print << line.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
  return 0;
}

/// Limits this process's memory to what the machine can spare now, so that too large a request ends in
/// std::bad_alloc and the kernel does not kill the largest process. Returns the limit in bytes, 0 if it is
/// not known.
std::uint64_t keep_within_memory() {
  std::uint64_t spare_bytes = 0;
  std::ifstream stream("/proc/meminfo");
  for (std::string line; std::getline(stream, line);) {
    unsigned long long kib = 0;
    if (std::sscanf(line.c_str(), "MemAvailable: %llu kB", &kib) == 1) spare_bytes = kib << 10;
  }
  rlimit limit{};
  if (spare_bytes == 0 || getrlimit(RLIMIT_DATA, &limit) != 0) return 0;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, spare_bytes);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // shadow memory counts as data
  setrlimit(RLIMIT_DATA, &limit);
#endif
  return limit.rlim_cur;
}

}  // namespace

int run_activate(const ActivateRequest& request, const WvaServerConfig& config, std::ostream& print) {
  check_request(request);
  const std::uint64_t memory_bytes = keep_within_memory();
  try {
    return activate_and_write(request, config, print);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(
        "activate: needs more memory than the " + std::to_string(memory_bytes >> 20) +
        " MiB that there are. Is the scale right? Larger voxels or fewer layers take less");
  }
}

}  // namespace phantom::wva_server
