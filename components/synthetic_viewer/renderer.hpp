#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "components/synthetic_viewer/frame.hpp"
#include "components/synthetic_viewer/gl_context.hpp"
#include "components/synthetic_viewer/image.hpp"
#include "components/synthetic_viewer/shaded_mesh.hpp"

namespace phantom::synthetic_viewer {

/// Size and quality of a picture.
struct PictureFormat {
  int width_px = 1280;
  int height_px = 720;
  /// Per pixel against jagged edges: 1, 2, 4 or 8. Software rendering takes 2–3 times as long with 4.
  int samples = 1;
  bool shadows = true;  ///< of the items that cast one, on the floor
};

/// Turns frames into pictures with OpenGL, without a window. Made, used and destroyed on one thread.
class Renderer {
 public:
  /// Throws core::MissingError if there is no OpenGL, std::runtime_error if the driver refuses the shaders.
  explicit Renderer(GraphicsPlatform platform = GraphicsPlatform::kAuto);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Gives a mesh to the graphics card, shaded, with a coarse stand-in for its shadow. Lasts until drop().
  MeshHandle upload(const geometry::TriangleMesh& mesh);
  void drop(MeshHandle mesh);

  /// Draws a frame. Items whose mesh is not there are left out. Blocks until the picture is done.
  Image render(const Frame& frame, const PictureFormat& format);

  const std::string& description() const { return context_.description(); }

 private:
  struct Mesh {
    std::uint32_t vertex_array = 0, vertices = 0, indices = 0;
    int index_count = 0;
    Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  // of a ball around it, in the mesh's frame
    float radius_m = 0.0F;
  };
  struct Programs;
  struct Target;
  static Mesh make_mesh(const ShadedMesh& mesh);
  static void drop(const Mesh& mesh);
  Target& target_for(const PictureFormat& format);
  void draw_background() const;
  void draw_floor(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const;
  void draw_shadows(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const;
  void draw_items(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const;
  bool in_sight(const DrawItem& item, const Eigen::Matrix4f& clip_from_W) const;
  void draw_item(const DrawItem& item) const;
  void draw_lines(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const;

  GlContext context_;
  std::map<MeshHandle, Mesh> meshes_;
  std::map<MeshHandle, Mesh> shadow_meshes_;
  MeshHandle next_handle_ = kFirstFreeHandle;
  std::unique_ptr<Programs> programs_;
  std::map<std::uint64_t, std::unique_ptr<Target>> targets_;  // by size and samples
};

}  // namespace phantom::synthetic_viewer
