#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/living.hpp"
#include "phantom_idl/teleoperation.hpp"
#include "phantom_idl/workspace.hpp"

namespace phantom::messages {

/// Convert from the topic's type; an error names the field, its value and what is allowed.
core::Expected<DepthImage> from_idl(const msg::DepthImage& message, const ArmBounds& arm = {});
core::Expected<OccupancyChange> from_idl(const msg::OccupancyChange& message, const ArmBounds& arm = {});

/// Convert to the topic's type. Throw core::ConfigError for a name that is longer than the topic takes.
msg::DepthImage to_idl(const DepthImage& image);
msg::OccupancyChange to_idl(const OccupancyChange& change);

}  // namespace phantom::messages
