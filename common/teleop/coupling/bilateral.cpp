#include "common/teleop/coupling/bilateral.hpp"

#include <array>
#include <utility>

namespace phantom::teleop {
namespace {

constexpr std::array<std::pair<BilateralLaw, const char*>, 5> kNames{{{BilateralLaw::kPf, "pf"},
                                                                      {BilateralLaw::kSctfb, "sctfb"},
                                                                      {BilateralLaw::kPfff, "pfff"},
                                                                      {BilateralLaw::kPe, "pe"},
                                                                      {BilateralLaw::kPeff, "peff"}}};

}  // namespace

const char* name_of(BilateralLaw law) noexcept {
  for (const auto& [candidate, name] : kNames) {
    if (candidate == law) return name;
  }
  return "unknown";
}

std::optional<BilateralLaw> law_from_name(std::string_view name) noexcept {
  for (const auto& [law, candidate] : kNames) {
    if (name == candidate) return law;
  }
  return std::nullopt;
}

bool needs_force_sensor(BilateralLaw law) noexcept {
  return law == BilateralLaw::kPfff || law == BilateralLaw::kPeff;
}

core::JointArray feedback_torque(BilateralLaw law, const JointMotion& master, const JointMotion& slave,
                                 const SlaveEffort& effort, const ExchangeGains& gains,
                                 const core::JointArray& inverse_a, std::size_t joint_count) noexcept {
  const bool exchange = law == BilateralLaw::kPe || law == BilateralLaw::kPeff;
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < joint_count; ++j) {
    double sum_Nm = 0.0;
    if (law == BilateralLaw::kSctfb) sum_Nm -= effort.loop_torque_Nm[j];
    if (needs_force_sensor(law))
      sum_Nm += (exchange ? gains.force_share : 1.0) * effort.external_torque_Nm[j];
    if (exchange) {
      sum_Nm -= gains.k_p[j] * (master.position[j] - slave.position[j]) +
                gains.k_v[j] * (master.velocity[j] - slave.velocity[j]);
    }
    torque_Nm[j] = inverse_a[j] * sum_Nm;
  }
  return torque_Nm;
}

}  // namespace phantom::teleop
