#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/render/gl_context.hpp"
#include "components/synthetic_viewer/samples/recent_samples.hpp"
#include "components/synthetic_viewer/scene/arm_meshes.hpp"
#include "components/synthetic_viewer/video/video_source.hpp"

namespace phantom::synthetic_viewer {

/// What a simulated camera sees: the cell's objects where they really stand, and its arms.
struct SimulatedWorld {
  runtime::CellConfig cell;
  robot::SerialArm arm;
  std::vector<LinkMeshData> arm_meshes;
  std::vector<OtherArmData> others = {};
};

/// Returns a source that renders the world as the lens images it: distorted, with noise, smeared over its
/// exposure, and late. The arms are as `past` has them in the middle of the exposure; not there while that is
/// not known. What an arm carries stands where it was at the start. `world` and `past` must outlive the
/// source. It has an OpenGL context of its own. Throws core::MissingError if there is no OpenGL,
/// core::ConfigError for a mesh that cannot be loaded.
std::unique_ptr<VideoSource> open_simulated_camera(const VideoCamera& camera, GraphicsPlatform graphics,
                                                   const SimulatedWorld& world, const RecentSamples& past);

}  // namespace phantom::synthetic_viewer
