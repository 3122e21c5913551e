#pragma once

#include <optional>

#include "components/synthetic_viewer/camera_control.hpp"
#include "components/synthetic_viewer/samples.hpp"
#include "components/synthetic_viewer/view_choice.hpp"

namespace phantom::synthetic_viewer {

/// Returns the request for a pointer drag: a drag over the picture's whole height turns the view by half a
/// turn.
ViewRequest drag_request(View view, double dx_px, double dy_px, double height_px);
/// Returns the request for turning the wheel. Positive notches, away from the user, bring the view closer.
ViewRequest wheel_request(View view, double notches);
/// Returns the look-from node for a key: 'N' 'S' 'E' 'W' 'T' 'B', '1' to '8', 'A' automatic. Upper case.
std::optional<ViewNode> node_of_key(char key);

/// The rectangle of a view in a window, in the window's coordinates (y down).
struct WindowPlace {
  double x = 0, y = 0, width = 0, height = 0;
  bool contains(double px, double py) const {
    return px >= x && px < x + width && py >= y && py < y + height;
  }
};
/// Returns the rectangle of a view. The main view fills the window as far as its shape (width ÷ height)
/// allows; the others overlap its right edge, a third as wide.
WindowPlace place_in_window(View view, double width, double height, double aspect);

}  // namespace phantom::synthetic_viewer
