#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/geometry/mesh/mesh.hpp"
#include "components/synthetic_viewer/render/frame.hpp"
#include "components/synthetic_viewer/render/gl_context.hpp"
#include "components/synthetic_viewer/render/image.hpp"
#include "components/synthetic_viewer/render/skin_paint.hpp"

namespace phantom::synthetic_viewer {

/// What all pictures have in common: how dark shadows are, and the unit vector to the light along which they
/// fall.
inline constexpr float kShadowOpacity = 0.33F;
Eigen::Vector3f to_key_light();

/// Size and quality of a picture.
struct PictureFormat {
  int width_px = 1280;
  int height_px = 720;
  /// Samples per pixel against jagged edges: 1, 2, 4 or 8. Software rendering takes 2–3 times as long with 4.
  int samples = 1;
  bool shadows = true;  ///< whether items that cast shadows do so on the floor
};

/// Returns true if more urgent work is waiting than the picture that is being drawn.
using CancelCheck = std::function<bool()>;

/// Renders frames to pictures with OpenGL, without a window. Created, used and destroyed on one thread.
class Renderer {
 public:
  /// `scale`: of the scenes to be drawn (scene_scale()), at which meshes are made coarser. Throws
  /// core::MissingError if there is no OpenGL, std::runtime_error if the driver refuses the shaders.
  explicit Renderer(GraphicsPlatform platform = GraphicsPlatform::kAuto, double scale = 1.0);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Uploads a mesh to the graphics card, shaded, with coarser versions for distant views and for its shadow.
  /// It remains until drop().
  MeshHandle upload(const geometry::TriangleMesh& mesh);
  void drop(MeshHandle mesh);
  /// Sets or changes the paint that DrawItem::paint names.
  void paint(PaintHandle name, const PaintVolume& volume);

  /// Renders a frame. Items whose mesh is missing are left out. Blocks until the picture is done.
  Image render(const Frame& frame, const PictureFormat& format);
  /// Renders a frame like render(), but calls `give_up` from time to time and returns nothing once that
  /// returns true.
  std::optional<Image> render_unless(const Frame& frame, const PictureFormat& format,
                                     const CancelCheck& give_up);

  const std::string& description() const { return context_.description(); }

 private:
  struct Parts;
  struct Body;
  struct Shot;
  void draw_background() const;
  void draw_backdrop(const Image& picture);
  void draw_over_video(const Frame& frame, const Shot& view) const;
  void draw_floor(const Frame& frame, const Shot& view) const;
  void draw_shadows(const Frame& frame, const Shot& view) const;
  bool draw_items(const Frame& frame, const Shot& view, const CancelCheck& give_up) const;
  int draw_item(const DrawItem& item, const Shot& view) const;
  int draw_item(const DrawItem& item, const Shot& view, unsigned program) const;
  void draw_lines(const Frame& frame, const Shot& view) const;
  const Body* in_sight(const DrawItem& item, const Shot& view) const;

  GlContext context_;
  double scale_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace phantom::synthetic_viewer
