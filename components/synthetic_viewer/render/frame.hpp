#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/pose.hpp"
#include "components/synthetic_viewer/render/camera.hpp"
#include "components/synthetic_viewer/render/image.hpp"

namespace phantom::synthetic_viewer {

using Colour = std::array<float, 3>;  ///< linear RGB, 0…1

/// Handle of a mesh that the renderer holds. The renderer provides the shapes below from the start, of unit
/// length and radius: cone and cylinder from z = 0 to 1, the cone with its tip at 1; sphere and disc around
/// the origin, the disc in z = 0.
using MeshHandle = std::uint32_t;
inline constexpr MeshHandle kNoMesh = 0, kCone = 1, kCylinder = 2, kSphere = 3, kDisc = 4;
inline constexpr MeshHandle kFirstFreeHandle = 16;

/// Handle of a paint volume that the renderer holds (Renderer::paint).
using PaintHandle = std::uint32_t;
inline constexpr PaintHandle kNoPaint = ~0U;

/// One mesh at a place.
struct DrawItem {
  MeshHandle mesh = kNoMesh;
  Eigen::Matrix4f W_from_mesh = Eigen::Matrix4f::Identity();  ///< affine; may scale, must not mirror
  Colour colour{0.7F, 0.7F, 0.7F};
  float opacity = 1.0F;       ///< below 1: drawn after all others, sorted, without hiding what is behind it
  float own_light = 0.0F;     ///< 0: lit like all else, 1: emits its own colour
  bool casts_shadow = false;  ///< casts a shadow on the floor
  PaintHandle paint = kNoPaint;
  /// Transform to the frame of the paint volume.
  Eigen::Matrix4f paint_from_mesh = Eigen::Matrix4f::Identity();
  /// Not drawn itself, as the picture behind shows it: it hides what is behind it, and its paint is seen.
  bool over_video = false;
};

struct Line {
  Eigen::Vector3f from_m, to_m;  ///< in W
};

/// The content of one picture.
struct Frame {
  Camera camera;
  std::vector<DrawItem> items;
  std::vector<Line> lines;
  Colour line_colour{0.10F, 0.15F, 0.20F};
  bool bold_lines = false;  ///< with a dark border, to be seen on any ground
  /// A picture as background, in place of the plain one; of the size that is drawn. Null: none.
  std::shared_ptr<const Image> backdrop;
  /// The floor's grid lies in the plane z = floor_min_m.z().
  Eigen::Vector3f floor_min_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f floor_max_m = Eigen::Vector3f::Zero();  ///< if not above floor_min_m, no floor
  float floor_border_m = 0.5F;                            ///< by so much it reaches beyond these, fading out
  float floor_pitch_m = 0.1F;                             ///< of its lines; every fifth is stronger
  std::array<Colour, 3> paint_ramp{};                     ///< of closeness 0, 0.5 and 1
  std::uint64_t paint_number = 0;                         ///< increases when any paint changes
};

/// Returns whether two frames make the same picture: all equal, positions within a hundredth of a millimetre.
bool same_picture(const Frame& a, const Frame& b);

/// Returns the DrawItem matrix for a pose, with the mesh scaled by `scale` first.
Eigen::Matrix4f matrix_of(const geometry::Pose& X_WM, const Eigen::Vector3d& scale = Eigen::Vector3d::Ones());

}  // namespace phantom::synthetic_viewer
