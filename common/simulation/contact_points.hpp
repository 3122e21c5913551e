#pragma once

#include <vector>

#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/simulation/contact_world.hpp"

namespace phantom::simulation {

/// Points on the skin's segments, rings and end faces (polygons as the circles around them), on its lines and
/// its meshes, about `pitch_m` apart; the pitch is widened until there are at most `max_points`. Throws
/// core::ConfigError if the skin names a link that the arm does not have.
std::vector<ContactPoint> contact_points(const robot::SerialArm& arm,
                                         const std::vector<robot::LinkSkin>& skins, double pitch_m,
                                         int max_points);

}  // namespace phantom::simulation
