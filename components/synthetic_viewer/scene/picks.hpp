#pragma once

#include <string>
#include <vector>

#include "common/camera/pose_fit.hpp"
#include "common/core/status.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::synthetic_viewer {

/// Reads a corner that was picked in a picture: "412.5,233=0.4,-0.2,0.8" (pixel, then the point in W, m),
/// "412.5,233=pump:0.1,0,0.05" (the corner of the mesh nearest to a point of the object's frame, within 20
/// mm), or "412.5,233=pump:+-+" (the mesh's corner towards the greatest x, least y and greatest z of the
/// object's frame: corner_towards()). `cell`: null if there is none; loads
/// the object's mesh. The error says what is wrong and what is allowed.
core::Expected<camera::SeenPoint> parse_pick(const std::string& text, const runtime::CellConfig* cell);

}  // namespace phantom::synthetic_viewer
