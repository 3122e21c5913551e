#pragma once

#include <string>

namespace phantom::synthetic_viewer {

/// Returns the renderer's programs as JSON for WebGL 2 (GLSL ES 3.00): {"mesh": {"vertex": …, "fragment": …},
/// "painted": …, "flat": …, "floor": …, "background": …}.
const std::string& shaders_json();

}  // namespace phantom::synthetic_viewer
