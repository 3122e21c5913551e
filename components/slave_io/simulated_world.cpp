#include "components/slave_io/simulated_world.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/errors.hpp"
#include "common/geometry/mesh/solid_moments.hpp"
#include "common/runtime/cell/cell_bodies.hpp"

namespace phantom::slave_io {
namespace {

bool is_soft(const runtime::CellConfig& cell, std::uint16_t id) {
  return !cell.objects.at(id - 1U).profile.stiffness_inside_Pa_per_m.empty();
}

robot::SkinLayout lay_out(const ArmModel& model, double pitch_m) {
  // By number, as point sensors on an axis may have no area.
  auto skin = robot::lay_out_skin(model.arm, model.skin,
                                  {.voxel_size_m = pitch_m, .normalisation = robot::Normalisation::kNone});
  if (!skin) throw core::ConfigError("skin: " + skin.status().message());
  return *std::move(skin);
}

/// Points of the skin about `pitch_m` apart, or as far as it takes for `most` of them.
robot::SkinLayout points_with_area(const ArmModel& model, double pitch_m, int most) {
  constexpr double kCoarse_m = 0.2;
  robot::SkinLayout skin = lay_out(model, std::max(kCoarse_m, pitch_m));
  const double area_m2 = std::accumulate(skin.area_m2.begin(), skin.area_m2.end(), 0.0);
  pitch_m = std::max(pitch_m, std::sqrt(area_m2 / most));
  // Above a pitch of one metre the number of points no longer falls.
  for (skin = lay_out(model, pitch_m); static_cast<int>(skin.size()) > most && pitch_m <= 1.0;)
    skin = lay_out(model, pitch_m *= 1.1);
  return skin;
}

}  // namespace

SimulatedWorld load_world(const runtime::CellConfig& cell, const ArmModel& model,
                          const ContactConfig& config) {
  SimulatedWorld world;
  const std::vector<geometry::PlacedMesh> bodies = runtime::load_real_bodies(cell);
  std::vector<std::uint16_t> soft;
  std::vector<simulation::SoftSolid> yielding;
  for (const geometry::PlacedMesh& body : bodies) {
    if (!is_soft(cell, body.id)) continue;
    soft.push_back(body.id);
    const workspace::LayerProfile& profile = cell.objects[body.id - 1U].profile;
    yielding.push_back(
        {body.id, body.mesh_W, simulation::soft_layers(profile, cell.voxel_size_m.reference_m())});
  }
  world.fixed = std::make_unique<const simulation::MeshWorld>(bodies, config.clearance_range_m, soft);
  for (runtime::LooseMesh& body : runtime::load_loose_bodies(cell)) {
    const geometry::SolidMoments moments = geometry::solid_moments(body.mesh_O);
    world.loose.push_back({body.id,
                           std::move(body.mesh_O),
                           {body.mass_kg, moments.centre_m, body.mass_kg * moments.inertia_m2, body.X_WO}});
  }
  if (yielding.empty() && cell.media.empty()) return world;
  world.yielding = std::make_unique<simulation::Yielding>(
      points_with_area(model, 2.0 * cell.voxel_size_m.reference_m(), config.max_points),
      robot::Medium(cell.media.begin(), cell.media.end()), yielding);
  return world;
}

}  // namespace phantom::slave_io
