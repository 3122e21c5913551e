#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::wva_server {

/// The text of a picture.
struct PictureText {
  std::string title;
  std::vector<std::string> layer_notes;  ///< per layer from 1, e.g. its viscosity; may be empty
};

/// Draws three sections through a workspace, coloured by neighbour order: seen from above (x to the right, y
/// up), from the front (x, z) and from the side (y, z), with axes in W, a scale bar and a legend. The
/// sections pass through the middle of the solid voxels (of the grid if there are none); red marks show
/// where. Returns the bytes of a PNG file. Not real-time safe.
std::vector<std::uint8_t> slice_picture(const workspace::Workspace& workspace, const PictureText& text);

}  // namespace phantom::wva_server
