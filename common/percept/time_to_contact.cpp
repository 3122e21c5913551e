#include "common/percept/time_to_contact.hpp"

namespace phantom::percept {
namespace {

constexpr int kMaxSteps = 256;             // more than a profile reaches (workspace::kMaxReach_vox)
constexpr double kShareOfDirection = 0.1;  // of the way, by which the PGV's direction may make it wrong
enum class Along { kFluid, kSurface, kOutside };

Along what_is(const workspace::Workspace& workspace, workspace::Index3 voxel) noexcept {
  const std::int8_t order = workspace.order(voxel);
  if (order >= workspace::kOrderBoundary || order < workspace::kOrderFree) return Along::kSurface;
  return order == workspace::kOrderFree ? Along::kOutside : Along::kFluid;
}

/// The way along a direction, up to the surface or, where none is met, to the place of greatest μ.
struct Way {
  double length_m = 0.0;
  bool met = false;
};

Way way_to_surface(const workspace::Workspace& workspace, const Eigen::Vector3d& from_m,
                   const Eigen::Vector3d& direction, double step_m) noexcept {
  const auto voxel_at = [&](int step) {
    return workspace.grid().index_of(from_m + step * step_m * direction);
  };
  int steps = 0;
  for (; steps <= kMaxSteps; ++steps) {
    const Along along = what_is(workspace, voxel_at(steps));
    if (along == Along::kOutside) break;
    // The boundary lies between this step and the one before.
    if (along == Along::kSurface) return {steps == 0 ? 0.0 : (steps - 0.5) * step_m, true};
  }
  Way way;
  std::uint8_t greatest = 0;
  for (int step = 0; step < steps; ++step) {
    const std::uint8_t code = workspace.mu_code(voxel_at(step));
    if (code > greatest) greatest = code, way.length_m = step * step_m;
  }
  return way;
}

}  // namespace

TimeToContact time_to_contact(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                              const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                              double least_speed_m_s) noexcept {
  TimeToContact contact;
  const double length_m = pgv_m.norm();
  if (!(length_m > 0.0)) return contact;
  const Eigen::Vector3d direction = pgv_m / length_m;
  const Eigen::Vector3d& sides_m = workspace.grid().voxel_size_m.sides_m();
  const Way way = way_to_surface(workspace, position_m, direction, sides_m.minCoeff());
  if (way.met) contact.gap_m = way.length_m;
  const double closing_m_s = direction.dot(velocity_m_s);
  if (!(closing_m_s > least_speed_m_s)) return contact;
  contact.time_s = way.length_m / closing_m_s;
  if (way.met) contact.error_s = (sides_m.norm() + kShareOfDirection * way.length_m) / closing_m_s;
  return contact;
}

}  // namespace phantom::percept
