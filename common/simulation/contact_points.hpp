#pragma once

#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/simulation/contact_world.hpp"

namespace phantom::simulation {

/// Returns points on the skin, about `pitch_m` apart: on the rings and end faces of its segments (polygons as
/// their circumscribed circles), on its lines and on its meshes. The pitch is widened until there are at most
/// `max_points`. Throws core::ConfigError if the skin names a link that the arm does not have.
std::vector<ContactPoint> contact_points(const robot::SerialArm& arm,
                                         const std::vector<robot::LinkSkin>& skins, double pitch_m,
                                         int max_points);

}  // namespace phantom::simulation
