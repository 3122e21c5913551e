#include "common/teleop/rendering/wrench_slew.hpp"

#include <algorithm>

namespace phantom::teleop {
namespace {

// Returns the share, 0…1, of `change` whose linear and angular parts stay within the two bounds.
double share_within(const Spatial& change, double linear, double angular) noexcept {
  const double moved = change.head<3>().stableNorm(), turned = change.tail<3>().stableNorm();
  const double a = moved > linear ? linear / moved : 1.0, b = turned > angular ? angular / turned : 1.0;
  return std::min(a, b);
}

}  // namespace

const Spatial& WrenchSlew::step(const Spatial& wanted, const Spatial& twist, double dt_s) noexcept {
  const auto& p = parameters_;
  Spatial aim = Spatial::Zero();
  if (wanted.allFinite()) aim = share_within(wanted, p.force_cap_N, p.moment_cap_N_m) * wanted;
  const Spatial change = aim - now_;
  now_ += share_within(change, p.force_rate_N_per_s * dt_s, p.moment_rate_Nm_per_s * dt_s) * change;
  const double power_W = now_.dot(twist), allowed_W = std::max(0.0, aim.dot(twist));
  if (!(power_W <= allowed_W)) now_ *= power_W > 0.0 ? (1.0 - 1e-12) * allowed_W / power_W : 0.0;
  return now_;
}

}  // namespace phantom::teleop
