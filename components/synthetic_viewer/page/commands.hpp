#pragma once

#include <string>

#include "common/core/status.hpp"
#include "common/web/page_sessions.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/camera_control.hpp"

namespace phantom::synthetic_viewer {

/// Returns the role that a command needs; none: the stop, which is for everybody.
std::optional<web::Role> role_for(teleop::CommandKind kind);

/// Parses {"kind": "set_percept_gain", "value": 1.5} as the operator's page posts it. `value` may be omitted
/// where a command needs none. The error message says what is wrong and what is allowed.
core::Expected<Command> parse_command(const std::string& json);

/// Parses the page's request to take an object or to put it down: {"object": "pump", "attach": true}. The
/// error message says what is wrong and what is allowed.
core::Expected<CarryRequest> parse_carry_request(const std::string& json);

/// Parses the page's request to correct the model: {"correct": 17} by the number of a doubt, {"found":
/// "pump"} by the object that a camera has found elsewhere, {"undo": "pump"} by the object whose newest
/// change is undone; or to decide about a thing that cameras see: {"freeze": "live object 1"}, discard and
/// restore likewise, or
/// {"call": "live object 1", "name": "bucket"}. The error message says what is wrong and what is allowed.
core::Expected<CorrectionRequest> parse_correction_request(const std::string& json);

/// Parses the page's request to move a view's camera, to record it, or to show the way from the tool to an
/// object: {"view": "main", "orbit_deg": [5, -2], "zoom": 0.9, "home": true, "record": true, "approach":
/// true}. All but `view` may be omitted. Angles are within ±180°, zoom is 0.1 to 10. The error message says
/// what is wrong and what is allowed.
core::Expected<ViewRequest> parse_view_request(const std::string& json);

}  // namespace phantom::synthetic_viewer
