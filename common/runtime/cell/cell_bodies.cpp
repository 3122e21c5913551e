#include "common/runtime/cell/cell_bodies.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <sstream>
#include <thread>

#include "common/core/errors.hpp"
#include "common/core/parallel.hpp"
#include "common/geometry/implicit/polygonise.hpp"
#include "common/geometry/mesh/mesh_report.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::runtime {
namespace {

using core::ConfigError;

std::string place_of_object(const ObjectConfig& object) { return object.place + " '" + object.name + "': "; }

std::string span_text(const geometry::BoundingBox& box) {
  std::ostringstream text;
  text.precision(3);
  const char* names = "xyz";
  for (int axis = 0; axis < 3; ++axis) {
    text << (axis == 0 ? "" : ", ") << names[axis] << ' ' << box.min_m[axis] << " to " << box.max_m[axis];
  }
  return text.str() + " m";
}

std::string extent_text(const Eigen::Vector3d& extent) {
  return fmt::format("{:.3g} × {:.3g} × {:.3g}", extent.x(), extent.y(), extent.z());
}

void check_place(const ObjectConfig& object, const geometry::TriangleMesh& mesh_W, const CellConfig& cell) {
  const Eigen::Vector3f reach_m = (object.profile.reach_vox() * cell.voxel_size_m.sides_m()).cast<float>();
  geometry::BoundingBox workspace;
  workspace.extend(cell.min_m.cast<float>() - reach_m);
  workspace.extend(cell.max_m.cast<float>() + reach_m);
  const geometry::BoundingBox box = mesh_W.bounding_box();
  if (box.intersects(workspace)) return;
  throw ConfigError(place_of_object(object) + "lies outside of the workspace with all its layers: it spans " +
                    span_text(box) + "; is its pose or its " +
                    (object.mesh.empty() ? "scale" : "mesh_scale") + " right?");
}

/// Refuses a mesh whose coordinates are too coarse to state its shape in the cell's voxels; notes one that
/// loses some of it.
void check_precision(const ObjectConfig& object, const geometry::TriangleMesh& mesh, const CellConfig& cell,
                     std::vector<std::string>& notes) {
  const double voxel_m = cell.voxel_size_m.sides_m().minCoeff();
  const geometry::CoordinatePrecision precision = geometry::coordinate_precision(mesh);
  if (precision.is_useless(voxel_m))
    throw ConfigError(place_of_object(object) + geometry::describe(precision, voxel_m));
  if (precision.is_coarse(voxel_m)) notes.push_back(geometry::describe(precision, voxel_m));
}

/// Far from W's origin the numbers of a mesh are coarse, however fine those of its file are.
void check_placed_precision(const ObjectConfig& object, const geometry::TriangleMesh& mesh_W,
                            const CellConfig& cell) {
  const double voxel_m = cell.voxel_size_m.sides_m().minCoeff();
  const geometry::CoordinatePrecision precision = geometry::coordinate_precision(mesh_W);
  if (object.solid_O || !precision.is_useless(voxel_m)) return;
  throw ConfigError(
      place_of_object(object) +
      fmt::format("pose: it reaches {:.6g} m from the origin of W, where coordinates of 32 bits are "
                  "rounded to {:.2g} m, too coarse for a voxel of {:g} m; allowed: a workspace and "
                  "poses nearer to the origin",
                  precision.farthest_m, precision.step_m, voxel_m));
}

geometry::TriangleMesh surface_of(const ObjectConfig& object, core::WorkBudget* budget,
                                  std::vector<std::string>& notes) {
  auto made = geometry::polygonise(*object.solid_O, {.budget = budget});
  if (budget != nullptr && budget->ended())
    throw ConfigError(place_of_object(object) +
                      workspace::ended_early({.budget = budget}, "making its surface").message());
  if (made.mesh.triangles.empty()) {
    throw ConfigError(place_of_object(object) +
                      "holds nothing: no point of its box is inside, or it is thinner than a " +
                      std::to_string(geometry::PolygoniseOptions{}.max_cells) + "th of its length");
  }
  if (!made.whole) {
    notes.push_back(
        "parts of the formula are thinner than a " + std::to_string(made.cells) +
        "th of its length: they are activated, but viewers and the simulated world do not have them");
  }
  return std::move(made.mesh);
}

/// Settles the unit of a mesh of which neither its file nor the cell says one: it must be the only usual unit
/// in which the mesh is no larger than the workspace and no smaller than a voxel.
void settle_unit(const ObjectConfig& object, const CellConfig& cell, geometry::LoadedMesh& mesh) {
  const auto turned = mesh.transformed({object.X_WO.rotation, Eigen::Vector3d::Zero()}).bounding_box();
  const Eigen::Vector3d units = (turned.max_m - turned.min_m).cast<double>() / mesh.scale;
  const Eigen::Vector3d most_m = cell.max_m - cell.min_m;
  std::vector<double> fitting;
  std::string choice;
  for (const double unit : geometry::kUsualUnits) {
    const bool is_small = ((unit * units).array() <= (1 + 1e-6) * most_m.array()).all();
    if (!is_small || unit * units.maxCoeff() < cell.voxel_size_m.reference_m()) continue;
    fitting.push_back(unit);
    choice += fmt::format("{}{:g} ({}, {} m)", choice.empty() ? "" : ", ", unit, geometry::unit_name(unit),
                          extent_text(unit * units));
  }
  if (fitting.size() == 1)
    return geometry::replace_guessed_unit(
        mesh, fitting[0],
        fmt::format("{} are assumed, the only usual unit in which its {} fit into the workspace",
                    geometry::unit_name(fitting[0]), extent_text(units)));
  const std::string problem =
      place_of_object(object) + "mesh_scale: is missing, and " + object.mesh.string() + " declares no unit";
  if (fitting.empty())
    throw ConfigError(
        fmt::format("{}; its {} units fit into the workspace of {} m neither as metres nor as centimetres, "
                    "millimetres or inches; allowed: metres per unit",
                    problem, extent_text(units), extent_text(most_m)));
  throw ConfigError(problem + "; allowed: metres per unit, for instance " + choice);
}

geometry::TriangleMesh load_surface(const ObjectConfig& object, const CellConfig& cell,
                                    const geometry::MeshImportOptions& limits, core::WorkBudget* budget,
                                    std::vector<std::string>& notes) {
  if (object.solid_O) return surface_of(object, budget, notes);
  if (object.mesh.empty()) return object.polyhedron_O;
  geometry::MeshImportOptions options = limits;
  options.scale = object.mesh_scale;
  options.y_up = object.y_up;
  auto mesh = geometry::load_mesh(object.mesh, options);
  if (!mesh) {
    const std::string problem = place_of_object(object) + mesh.status().message();
    if (mesh.status().code() == core::ErrorCode::kNotFound) throw core::MissingError(problem);
    throw ConfigError(problem);
  }
  if (mesh->scale_from == geometry::KnownFrom::kGuess) settle_unit(object, cell, *mesh);
  notes.insert(notes.end(), mesh->notes.begin(), mesh->notes.end());
  return std::move(*mesh);
}

/// Calls work(index) for each object of the cell, on all cores, because each import is a process of its own.
/// Of several failures, that of the object with the lowest index is thrown.
template <class Work>
void for_each_object(const CellConfig& cell, const Work& work) {
  std::vector<std::exception_ptr> failures(cell.objects.size());
  const auto threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  core::parallel_for(threads, cell.objects.size(), [&](std::size_t i, std::size_t) {
    try {
      work(i);
    } catch (...) {
      failures[i] = std::current_exception();
    }
  });
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace

workspace::GridSpec grid_of(const CellConfig& cell) {
  return layers::grid_over(cell.min_m, cell.max_m, cell.voxel_size_m);
}

CellBody load_body(const ObjectConfig& object, const CellConfig& cell,
                   const geometry::MeshImportOptions& limits, core::WorkBudget* budget) {
  CellBody loaded;
  loaded.mesh_O = load_surface(object, cell, limits, budget, loaded.notes);
  spdlog::debug("object {}: {} triangles from {}", object.name, loaded.mesh_O.triangles.size(),
                object.mesh.empty() ? "the cell's text" : object.mesh.string());
  if (!object.solid_O) check_precision(object, loaded.mesh_O, cell, loaded.notes);
  loaded.body = place_body(object, loaded.mesh_O, cell);
  return loaded;
}

layers::Body place_body(const ObjectConfig& object, const geometry::TriangleMesh& mesh_O,
                        const CellConfig& cell) {
  layers::Body body{object.name, object.id, mesh_O.transformed(object.X_WO), object.profile};
  if (object.solid_O) body.implicit_W = geometry::implicit_placed(object.solid_O, object.X_WO);
  body.solid = !object.is_zone();
  check_place(object, body.mesh_W, cell);
  check_placed_precision(object, body.mesh_W, cell);
  return body;
}

std::vector<CellBody> load_bodies(const CellConfig& cell, const geometry::MeshImportOptions& limits) {
  if (cell.objects.empty())
    spdlog::warn("{}: cell {} has no objects: nothing is felt in it unless commands add some",
                 cell.file.string(), cell.name);
  std::vector<CellBody> bodies(cell.objects.size());
  for_each_object(cell, [&](std::size_t i) { bodies[i] = load_body(cell.objects[i], cell, limits); });
  std::vector<workspace::LayerProfile> profiles;
  for (const CellBody& body : bodies) profiles.push_back(body.body.profile);
  if (const auto palette = workspace::make_palette(profiles); !palette) {
    throw ConfigError(cell.file.string() + ": objects: " + palette.status().message());
  }
  return bodies;
}

namespace {

/// Returns what load(object, surface) makes of the cell's objects of which wanted(object) is true, in their
/// order. The notes on surfaces are not used: wva_server reports them.
template <class Wanted, class Load>
auto load_some(const CellConfig& cell, const geometry::MeshImportOptions& limits, const Wanted& wanted,
               const Load& load) {
  std::vector<std::optional<decltype(load(cell.objects[0], geometry::TriangleMesh()))>> all(
      cell.objects.size());
  for_each_object(cell, [&](std::size_t i) {
    std::vector<std::string> notes;
    if (wanted(cell.objects[i]))
      all[i] = load(cell.objects[i], load_surface(cell.objects[i], cell, limits, nullptr, notes));
  });
  std::vector<decltype(load(cell.objects[0], geometry::TriangleMesh()))> chosen;
  for (auto& one : all) {
    if (one) chosen.push_back(*std::move(one));
  }
  return chosen;
}

}  // namespace

std::vector<geometry::PlacedMesh> load_real_bodies(const CellConfig& cell,
                                                   const geometry::MeshImportOptions& limits) {
  return load_some(
      cell, limits,
      [](const ObjectConfig& object) {
        return !object.loose && !object.is_zone() && !(object.hold && !object.hold->arm.empty());
      },
      [](const ObjectConfig& object, const geometry::TriangleMesh& mesh_O) {
        return geometry::PlacedMesh{mesh_O.transformed(object.X_WO * object.X_deviation), object.id};
      });
}

std::vector<LooseMesh> load_loose_bodies(const CellConfig& cell, const geometry::MeshImportOptions& limits) {
  return load_some(
      cell, limits, [](const ObjectConfig& object) { return object.loose; },
      [](const ObjectConfig& object, geometry::TriangleMesh mesh_O) {
        return LooseMesh{object.id, std::move(mesh_O), object.X_WO * object.X_deviation, object.mass_kg};
      });
}

}  // namespace phantom::runtime
