#include "components/slave_io/model.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/runtime/arm_model.hpp"

namespace phantom::slave_io {
namespace {

using core::ConfigError;

constexpr double kFineBand_vox = 3.0;

voxelise::DistanceField build_field(const runtime::CellConfig& cell,
                                    const std::vector<voxelise::FieldBody>& bodies, double voxel_m,
                                    double band_m, const FieldWorld::KeepGoing& keep_going,
                                    const FieldCache* cache) {
  workspace::GridSpec grid;
  grid.origin_m = cell.min_m;
  grid.voxel_size_m = voxel_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    grid.size_vox[axis] =
        static_cast<std::int32_t>(std::ceil((cell.max_m[i] - cell.min_m[i]) / voxel_m - 1e-9));
  }
  const voxelise::DistanceFieldOptions options{
      .outside_m = band_m, .inside_m = std::min(band_m, 0.08), .keep_going = keep_going};
  const std::string recipe = cache != nullptr ? FieldCache::recipe(grid, bodies, options) : "";
  if (cache != nullptr)
    if (auto kept = cache->find(recipe)) return *std::move(kept);
  auto field = voxelise::DistanceField::build(grid, bodies, options);
  if (!field && field.status().code() == core::ErrorCode::kUnavailable) throw FieldWorld::Ended{};
  if (!field) throw ConfigError(cell.file.string() + ": contact field: " + field.status().message());
  if (cache != nullptr) cache->keep(recipe, *field);
  return *std::move(field);
}

}  // namespace

ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name) {
  const runtime::ArmConfig& config = cell.arm(arm_name);
  ArmModel model{runtime::load_arm(config), {}, Eigen::Vector3d::Zero(), {}};
  model.skin = runtime::load_skin(config, model.arm);
  std::copy(config.home.begin(), config.home.end(), model.home.begin());
  if (const auto tip = model.arm.find_frame(config.tip_link))
    model.tip_in_last_link_m = tip->second.translation_m;
  return model;
}

FieldWorld::FieldWorld(const runtime::CellConfig& cell, const std::vector<voxelise::FieldBody>& bodies,
                       const ContactConfig& config, const KeepGoing& keep_going, const FieldCache* cache)
    : fine_(build_field(cell, bodies, config.touch_voxel_m, kFineBand_vox * config.touch_voxel_m, keep_going,
                        cache)),
      coarse_(
          build_field(cell, bodies, config.clearance_voxel_m, config.clearance_range_m, keep_going, cache)) {}

double FieldWorld::distance_m(const Eigen::Vector3d& p_W_m) const noexcept {
  const double coarse_m = coarse_.distance_m(p_W_m);
  // The error of the coarse field is a large part of its voxel.
  if (coarse_m > fine_.outside_m() + coarse_.grid().voxel_size_m) return coarse_m;
  const double fine_m = fine_.distance_m(p_W_m);
  if (std::abs(fine_m) < 0.99 * fine_.outside_m()) return fine_m;
  return fine_m > 0.0 ? std::max(fine_m, coarse_m) : std::min(fine_m, coarse_m);
}

simulation::ContactQuery FieldWorld::query(const Eigen::Vector3d& p_W_m) const noexcept {
  simulation::ContactQuery found;
  found.distance_m = distance_m(p_W_m);
  // At the end of the fine band the samples are clipped, so the gradient is wrong there.
  const bool in_fine_band = std::abs(found.distance_m) < 0.6 * fine_.outside_m();
  const Eigen::Vector3d slope = in_fine_band ? fine_.gradient(p_W_m) : coarse_.gradient(p_W_m);
  const double norm = slope.norm();
  if (norm > 1e-6) found.normal_W = slope / norm;
  found.object = fine_.object(p_W_m);
  if (found.object == 0) found.object = coarse_.object(p_W_m);
  return found;
}

}  // namespace phantom::slave_io
