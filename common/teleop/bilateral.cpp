#include "common/teleop/bilateral.hpp"

#include <algorithm>
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

bool is_supported(BilateralLaw law) noexcept {
  return law == BilateralLaw::kPf || law == BilateralLaw::kSctfb;
}

core::JointArray feedback_torque(BilateralLaw law, const SlaveEffort& slave, double inverse_a,
                                 std::size_t joint_count) noexcept {
  core::JointArray torque_Nm{};
  if (law != BilateralLaw::kSctfb) return torque_Nm;
  for (std::size_t j = 0; j < joint_count; ++j) torque_Nm[j] = -inverse_a * slave.loop_torque_Nm[j];
  return torque_Nm;
}

core::JointArray master_torque(const core::JointArray& percept_Nm, const core::JointArray& feedback_Nm,
                               const core::JointArray& limit_Nm, std::size_t joint_count) noexcept {
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < joint_count; ++j) {
    torque_Nm[j] = std::clamp(percept_Nm[j] + feedback_Nm[j], -limit_Nm[j], limit_Nm[j]);
  }
  return torque_Nm;
}

}  // namespace phantom::teleop
