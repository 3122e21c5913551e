#pragma once

#include <optional>

#include "components/synthetic_viewer/camera_control.hpp"
#include "components/synthetic_viewer/samples.hpp"
#include "components/synthetic_viewer/view_choice.hpp"

namespace phantom::synthetic_viewer {

/// How far a drag turns a view: a drag over the picture's whole height is half a turn.
ViewRequest drag_request(View view, double dx_px, double dy_px, double height_px);
/// One notch of the wheel, positive away from the user: closer.
ViewRequest wheel_request(View view, double notches);
/// The look-from node that a key names: 'N' 'S' 'E' 'W' 'T' 'B', '1' to '8', 'A' automatic. Upper case.
std::optional<ViewNode> node_of_key(char key);

/// Where the views lie in a window, in its coordinates (y down).
struct WindowPlace {
  double x = 0, y = 0, width = 0, height = 0;
  bool contains(double px, double py) const {
    return px >= x && px < x + width && py >= y && py < y + height;
  }
};
/// The main view fills the window as far as its shape (width ÷ height) allows; the others lie over its right
/// edge, a third as wide.
WindowPlace place_in_window(View view, double width, double height, double aspect);

}  // namespace phantom::synthetic_viewer
