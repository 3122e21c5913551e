#pragma once

#include <string>

#include "components/wva_server/carriers.hpp"
#include "components/wva_server/grasp_watch.hpp"
#include "components/wva_server/service.hpp"
#include "components/wva_server/wva_server.hpp"

// What the service is made of, from its configuration and the cell. Each throws core::ConfigError.

namespace phantom::wva_server {

AddLimits add_limits(const WvaServerConfig& config);
/// Returns the watch over the gripper of the followed arm; over none if there is none, or it is not wanted.
GraspWatch grasp_watch(const runtime::CellConfig& cell, const Carriers& carriers,
                       const WvaServerConfig& config);
/// Returns why every command is refused; empty: it is not.
std::string refusal_of(const WvaServerConfig& config, const ServedCell& served);
/// Logs what was assumed about an object's mesh.
void warn_of(const ServedObject& object);

}  // namespace phantom::wva_server
