#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::wva_server {

/// What is written into a picture besides the voxels.
struct PictureText {
  std::string title;
  std::vector<std::string> layer_notes;  ///< per layer from 1, e.g. its viscosity; may be empty
};

/// Three sections through a workspace, coloured by neighbour order, as PNG: seen from above (x to the right,
/// y up), from the front (x, z) and from the side (y, z), with axes in W, a scale bar and a legend. They pass
/// through the middle of what is there (bricks that exist); thin lines mark where. Returns the file's bytes.
/// Not real-time safe.
std::vector<std::uint8_t> slice_picture(const workspace::Workspace& workspace, const PictureText& text);

}  // namespace phantom::wva_server
