#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/messages/workspace.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::slave_io {

/// Which of what arms carry counts for this arm.
struct PayloadRule {
  const robot::SerialArm* arm = nullptr;
  std::string name;                                 ///< of the arm, in the cell file
  double limit_kg = 0.0;                            ///< what weighs more in all is refused
  std::vector<std::uint16_t> weighed;               ///< ids of objects whose weight the arm has already
  std::map<std::uint16_t, double> volumes_m3 = {};  ///< by id; of one that is not there it is unknown
};

/// Returns what the arm carries, as bodies on its links, with the volumes that are known. Bodies of unknown
/// mass count nothing. Refuses, with
/// a sentence, a payload that the rule does not allow or on links that the arm does not have.
core::Expected<robot::Payload> payload_of(const std::vector<messages::CarriedObject>& carried,
                                          const PayloadRule& rule);

}  // namespace phantom::slave_io
