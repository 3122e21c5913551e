#pragma once

#include <cstdint>
#include <map>

#include "common/robot/drag/buoyancy.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::runtime {

/// Returns the lift of the links of a cell's arm in the cell's media. A link displaces what its visuals
/// enclose, or what the arm's file states (`displaced`). Logs it, and where an open visual was closed. Where
/// no medium has a density, nothing is loaded and nothing lifts. Throws ConfigError naming the arm's file and
/// the link: one that the arm does not have or that stands twice; one with mass that displaces nothing and of
/// which nothing is stated. Throws as load_arm() if a mesh cannot be read. Not real-time safe.
robot::Buoyancy load_buoyancy(const CellConfig& cell, const ArmConfig& config, const robot::SerialArm& arm);

/// Returns the volumes of the cell's objects by id, as geometry::solid_moments() has them. Throws as
/// load_body().
std::map<std::uint16_t, double> object_volumes_m3(const CellConfig& cell);

}  // namespace phantom::runtime
