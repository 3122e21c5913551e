#include "common/teleop/percept_set.hpp"

#include <array>

namespace phantom::teleop {

PerceptSet percept_set(BilateralLaw law, bool balanced) noexcept {
  using enum PerceptRole;
  switch (law) {
    case BilateralLaw::kPf:
      return {kEssential, kHelpful, kHelpful,
              "drag is the only feedback there is; the tone tells of slow approaches"};
    case BilateralLaw::kSctfb:
      if (balanced)
        return {kEssential, kHelpful, kHelpful, "drag before contact, the slave's torque in contact"};
      return {kHelpful, kEssential, kHelpful,
              "the arm's weight is felt all the time and masks the drag: listen"};
    case BilateralLaw::kPfff:
      return {kEssential, kHelpful, kHelpful, "drag before contact, the measured force in contact"};
    case BilateralLaw::kPe:
    case BilateralLaw::kPeff:
      return {kWeak, kEssential, kEssential,
              "the slave's lag drags on the hand everywhere, so drag does not stand apart"};
  }
  return {kEssential, kEssential, kEssential, ""};
}

const char* name_of(PerceptRole role) noexcept {
  constexpr std::array kNames{"helpful", "essential", "weak"};
  return kNames[static_cast<std::size_t>(role)];
}

}  // namespace phantom::teleop
