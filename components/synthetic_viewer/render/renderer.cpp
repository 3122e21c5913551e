#include "components/synthetic_viewer/render/renderer.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/render/gl_objects.hpp"
#include "components/synthetic_viewer/render/shaders.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr int kPartSides = 32;          // sides of the round shapes of arrows and marks
constexpr double kDiscHeight_m = 1e-4;  // the disc has two faces
// Each call of CancelCheck costs about a millisecond in software rendering, because the driver must first
// finish what it was given.
constexpr int kTrianglesBetweenQuestions = 8000;

bool given_up(const CancelCheck& give_up) {
  if (!give_up) return false;
  glFinish();
  return give_up();
}

/// Moves a unit shape from around the origin to z = 0 to 1.
geometry::TriangleMesh lifted(geometry::TriangleMesh unit) {
  for (Eigen::Vector3f& v : unit.vertices_m) v.z() += 0.5F;
  return unit;
}

Eigen::Vector4f with_opacity(const Colour& colour, float opacity) {
  return {colour[0], colour[1], colour[2], opacity};
}

/// Returns by how much an item's matrix enlarges its mesh.
float scale_of(const DrawItem& item) {
  return item.W_from_mesh.topLeftCorner<3, 3>().colwise().norm().maxCoeff();
}

/// Draws over the whole picture by a program that needs no vertices.
void fill_picture(GLuint program, GLuint empty_array) {
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glUseProgram(program);
  glBindVertexArray(empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_CULL_FACE);
}

/// Returns the matrix that projects along the key light onto the plane z = floor_z.
Eigen::Matrix4f shadow_matrix(float floor_z) {
  const Eigen::Vector3f slope = to_key_light() / to_key_light().z();
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix(0, 2) = -slope.x();
  matrix(1, 2) = -slope.y();
  matrix(2, 2) = 0;
  matrix(0, 3) = slope.x() * floor_z;
  matrix(1, 3) = slope.y() * floor_z;
  matrix(2, 3) = floor_z;
  return matrix;
}

}  // namespace

// As in the mesh shader.
Eigen::Vector3f to_key_light() { return {0.348F, -0.464F, 0.815F}; }

/// gl::Body, by a name that the header can declare.
struct Renderer::Body : gl::Body {};

/// The picture that is being drawn.
struct Renderer::Shot {
  Eigen::Matrix4f clip_from_W;
  Eigen::Vector3f eye_m;
  float pixels_per_radian;  // in the picture's middle
  Eigen::Vector2f pixel;    // size of one in clip coordinates
};

struct Renderer::Parts {
  GLuint plain = gl::link_program(shaders::kMeshVertex, shaders::kMeshFragment);
  GLuint painted = gl::link_program(shaders::kMeshVertex, shaders::kMeshFragment, "#define PAINTED\n");
  GLuint flat = gl::link_program(shaders::kFlatVertex, shaders::kFlatFragment);
  GLuint background = gl::link_program(shaders::kBackgroundVertex, shaders::kBackgroundFragment);
  GLuint floor = gl::link_program(shaders::kFloorVertex, shaders::kFloorFragment);
  GLuint over_video =
      gl::link_program(shaders::kMeshVertex, shaders::kMeshFragment, "#define PAINTED\n#define OVER_VIDEO\n");
  GLuint backdrop = gl::link_program(shaders::kBackgroundVertex, shaders::kBackdropFragment);
  GLuint backdrop_texture = 0;
  GLuint empty_array = 0, line_array = 0, line_buffer = 0;
  std::map<MeshHandle, Body> bodies;
  std::map<PaintHandle, gl::Paint> paints;
  std::map<std::array<int, 3>, gl::Target> targets;  // by size and samples
  MeshHandle next_handle = kFirstFreeHandle;

  gl::Target& target_for(const PictureFormat& format) {
    GLint most = 1;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    const int samples = std::clamp(format.samples, 1, std::max(1, static_cast<int>(most)));
    const std::array key{format.width_px, format.height_px, samples};
    return targets.try_emplace(key, format.width_px, format.height_px, samples).first->second;
  }
};

Renderer::Renderer(GraphicsPlatform platform, double scale)
    : context_(platform), scale_(scale), parts_(std::make_unique<Parts>()) {
  parts_->bodies[kCone] = {gl::Body::make(shade(lifted(geometry::make_cone(1.0, 0.0, 1.0, kPartSides))))};
  parts_->bodies[kCylinder] = {gl::Body::make(shade(lifted(geometry::make_cylinder(1.0, 1.0, kPartSides))))};
  parts_->bodies[kSphere] = {gl::Body::make(shade(geometry::make_sphere(1.0, 3)))};
  parts_->bodies[kDisc] = {gl::Body::make(shade(geometry::make_cylinder(1.0, kDiscHeight_m, kPartSides)))};
  glGenVertexArrays(1, &parts_->empty_array);
  glGenVertexArrays(1, &parts_->line_array);
  glGenBuffers(1, &parts_->line_buffer);
  glBindVertexArray(parts_->line_array);
  glBindBuffer(GL_ARRAY_BUFFER, parts_->line_buffer);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
}

Renderer::~Renderer() = default;  // the context destroys its objects

MeshHandle Renderer::upload(const geometry::TriangleMesh& mesh) {
  parts_->bodies[parts_->next_handle] = {gl::Body::with_levels(mesh, scale_)};
  return parts_->next_handle++;
}

void Renderer::drop(MeshHandle handle) {
  const auto found = parts_->bodies.find(handle);
  if (found == parts_->bodies.end()) return;
  found->second.drop();
  parts_->bodies.erase(found);
}

void Renderer::paint(PaintHandle name, const PaintVolume& volume) {
  if (volume.size[0] > 0) parts_->paints[name].load(volume);
}

Image Renderer::render(const Frame& frame, const PictureFormat& format) {
  return *render_unless(frame, format, {});
}

std::optional<Image> Renderer::render_unless(const Frame& frame, const PictureFormat& format,
                                             const CancelCheck& give_up) {
  gl::Target& target = parts_->target_for(format);
  const double aspect = static_cast<double>(format.width_px) / format.height_px;
  // OpenGL's rows run upwards. The picture is drawn upside down (with the sense of front faces turned), so
  // that its rows are read back in image order without a copy.
  Shot view{(projection_matrix(frame.camera, aspect) * view_matrix(frame.camera)).cast<float>(),
            frame.camera.eye_m.cast<float>(),
            static_cast<float>(format.height_px / (2 * std::tan(frame.camera.vertical_fov_rad / 2))),
            {2.0F / static_cast<float>(format.width_px), 2.0F / static_cast<float>(format.height_px)}};
  view.clip_from_W.row(1) *= -1.0F;
  glBindFramebuffer(GL_FRAMEBUFFER, target.frame);
  glViewport(0, 0, format.width_px, format.height_px);
  glFrontFace(GL_CW);
  glEnable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  frame.backdrop ? draw_backdrop(*frame.backdrop) : draw_background();
  draw_floor(frame, view);
  if (format.shadows) draw_shadows(frame, view);
  draw_over_video(frame, view);
  draw_lines(frame, view);
  if (!draw_items(frame, view, give_up)) return std::nullopt;
  if (target.plain_frame != 0) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target.frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.plain_frame);
    glBlitFramebuffer(0, 0, format.width_px, format.height_px, 0, 0, format.width_px, format.height_px,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target.plain_frame);
  }
  Image image(format.height_px, format.width_px, CV_8UC3);
  glReadPixels(0, 0, format.width_px, format.height_px, GL_BGR, GL_UNSIGNED_BYTE, image.data);
  return image;
}

void Renderer::draw_background() const { fill_picture(parts_->background, parts_->empty_array); }

void Renderer::draw_backdrop(const Image& picture) {
  if (parts_->backdrop_texture == 0) glGenTextures(1, &parts_->backdrop_texture);
  glBindTexture(GL_TEXTURE_2D, parts_->backdrop_texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, picture.cols, picture.rows, 0, GL_BGR, GL_UNSIGNED_BYTE,
               picture.data);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  fill_picture(parts_->backdrop, parts_->empty_array);
}

/// Draws the items that the backdrop shows already: first their depths alone, then the paint on them.
void Renderer::draw_over_video(const Frame& frame, const Shot& view) const {
  const auto all = [&](bool painted_only, GLuint program) {
    glUseProgram(program);
    gl::set(program, "clip_from_world", view.clip_from_W);
    gl::set(program, "eye", view.eye_m);
    for (const DrawItem& item : frame.items) {
      const bool painted = parts_->paints.count(item.paint) > 0;
      if (item.over_video && (painted || !painted_only) && in_sight(item, view) != nullptr)
        draw_item(item, view, program);
    }
  };
  if (std::ranges::none_of(frame.items, &DrawItem::over_video)) return;
  glEnable(GL_DEPTH_TEST);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glEnable(GL_POLYGON_OFFSET_FILL);  // a little back, so that what lies on a surface is not hidden by it
  glPolygonOffset(1.5F, 8.0F);
  all(false, parts_->plain);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glUseProgram(parts_->over_video);
  glUniform3fv(glGetUniformLocation(parts_->over_video, "ramp"), 3, frame.paint_ramp[0].data());
  glEnable(GL_BLEND);
  glDepthMask(GL_FALSE);
  all(true, parts_->over_video);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

void Renderer::draw_floor(const Frame& frame, const Shot& view) const {
  if (!(frame.floor_max_m.x() > frame.floor_min_m.x())) return;
  glEnable(GL_BLEND);
  glUseProgram(parts_->floor);
  gl::set(parts_->floor, "clip_from_world", view.clip_from_W);
  gl::set(parts_->floor, "least", frame.floor_min_m);
  gl::set(parts_->floor, "greatest", frame.floor_max_m);
  gl::set(parts_->floor, "border", frame.floor_border_m);
  gl::set(parts_->floor, "pitch", frame.floor_pitch_m);
  glBindVertexArray(parts_->empty_array);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

void Renderer::draw_shadows(const Frame& frame, const Shot& view) const {
  // From below, the floor and the shadows on it are not drawn.
  if (frame.camera.eye_m.z() <= frame.floor_min_m.z() || !(frame.floor_max_m.x() > frame.floor_min_m.x()))
    return;
  const Eigen::Matrix4f flatten = view.clip_from_W * shadow_matrix(frame.floor_min_m.z());
  glEnable(GL_BLEND);
  glDisable(GL_CULL_FACE);    // the coarse meshes are not closed
  glEnable(GL_STENCIL_TEST);  // so that overlapping shadows do not darken twice
  glStencilFunc(GL_EQUAL, 0, 0xFF);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
  glUseProgram(parts_->flat);
  gl::set(parts_->flat, "colour", Eigen::Vector4f(0.0F, 0.0F, 0.0F, kShadowOpacity));
  for (const DrawItem& item : frame.items) {
    const auto found = parts_->bodies.find(item.mesh);
    if (!item.casts_shadow || found == parts_->bodies.end() || found->second.shadow.index_count == 0)
      continue;
    gl::set(parts_->flat, "clip_from_mesh", Eigen::Matrix4f(flatten * item.W_from_mesh));
    found->second.shadow.draw();
  }
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void Renderer::draw_lines(const Frame& frame, const Shot& view) const {
  if (frame.lines.empty()) return;
  static_assert(sizeof(Line) == 6 * sizeof(float));
  glEnable(GL_DEPTH_TEST);
  glUseProgram(parts_->flat);
  glBindVertexArray(parts_->line_array);
  glBindBuffer(GL_ARRAY_BUFFER, parts_->line_buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(frame.lines.size() * sizeof(Line)),
               frame.lines.data(), GL_STREAM_DRAW);
  // Wider lines are several, a pixel apart: the core profile has no others.
  const auto draw = [&](const Eigen::Vector4f& colour, float first_px, float last_px) {
    gl::set(parts_->flat, "colour", colour);
    for (float x = first_px; x <= last_px; x += 1.0F)
      for (float y = first_px; y <= last_px; y += 1.0F) {
        Eigen::Matrix4f moved = view.clip_from_W;
        moved.row(0) += x * view.pixel.x() * view.clip_from_W.row(3);
        moved.row(1) += y * view.pixel.y() * view.clip_from_W.row(3);
        gl::set(parts_->flat, "clip_from_mesh", moved);
        glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(2 * frame.lines.size()));
      }
  };
  if (!frame.bold_lines) return draw(with_opacity(frame.line_colour, 1.0F), 0.0F, 0.0F);
  glEnable(GL_BLEND);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_FALSE);
  draw({0.0F, 0.0F, 0.0F, 0.25F}, -1.0F, 1.0F);
  draw(with_opacity(frame.line_colour, 1.0F), 0.0F, 0.0F);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
}

/// Draws the items. Returns false if that was given up.
bool Renderer::draw_items(const Frame& frame, const Shot& view, const CancelCheck& give_up) const {
  if (given_up(give_up)) return false;
  glEnable(GL_DEPTH_TEST);
  for (const GLuint program : {parts_->plain, parts_->painted}) {
    glUseProgram(program);
    gl::set(program, "clip_from_world", view.clip_from_W);
    gl::set(program, "eye", view.eye_m);
  }
  glUniform3fv(glGetUniformLocation(parts_->painted, "ramp"), 3, frame.paint_ramp[0].data());
  std::vector<std::pair<float, const DrawItem*>> solid, see_through;  // by distance from the eye
  for (const DrawItem& item : frame.items) {
    const Body* body = item.over_video ? nullptr : in_sight(item, view);
    if (body == nullptr) continue;
    const Eigen::Vector3f middle_m = (item.W_from_mesh * body->middle_m.homogeneous()).head<3>();
    (item.opacity >= 1.0F ? solid : see_through).emplace_back((middle_m - view.eye_m).norm(), &item);
  }
  const auto nearer = [](const auto& a, const auto& b) { return a.first < b.first; };
  // Nearest first, so that hidden parts need no shading.
  std::stable_sort(solid.begin(), solid.end(), nearer);
  int triangles = 0;
  for (const auto& item : solid) {
    triangles += draw_item(*item.second, view);
    if (triangles < kTrianglesBetweenQuestions) continue;
    triangles = 0;
    if (given_up(give_up)) return false;
  }
  std::stable_sort(see_through.rbegin(), see_through.rend(), nearer);
  glEnable(GL_BLEND);
  glDepthMask(GL_FALSE);
  for (const auto& item : see_through) draw_item(*item.second, view);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  return !given_up(give_up);
}

/// Returns the item's body; null if it does not exist, or if its bounding sphere lies outside one of the
/// picture's borders, which saves transforming its vertices.
const Renderer::Body* Renderer::in_sight(const DrawItem& item, const Shot& view) const {
  const auto found = parts_->bodies.find(item.mesh);
  if (found == parts_->bodies.end()) return nullptr;
  const Eigen::Vector4f middle = item.W_from_mesh * found->second.middle_m.homogeneous();
  const float radius = found->second.radius_m * scale_of(item);
  for (int border = 0; border < 4; ++border) {  // clip w ± clip x, y ≥ 0 inside
    const Eigen::RowVector4f plane =
        view.clip_from_W.row(3) + (border % 2 == 0 ? 1.0F : -1.0F) * view.clip_from_W.row(border / 2);
    if (plane.dot(middle) < -radius * plane.head<3>().norm()) return nullptr;
  }
  return &found->second;
}

/// Draws an item. Returns its number of triangles.
int Renderer::draw_item(const DrawItem& item, const Shot& view) const {
  return draw_item(item, view, parts_->paints.count(item.paint) > 0 ? parts_->painted : parts_->plain);
}

int Renderer::draw_item(const DrawItem& item, const Shot& view, unsigned program) const {
  const Body& body = parts_->bodies.at(item.mesh);
  const auto paint = parts_->paints.find(item.paint);
  const bool painted = paint != parts_->paints.end() && program != parts_->plain;
  const float scale = scale_of(item);
  glUseProgram(program);
  if (painted) {
    glBindTexture(GL_TEXTURE_3D, paint->second.texture);
    gl::set(program, "texture_from_mesh",
            Eigen::Matrix4f(paint->second.texture_from_paint * item.paint_from_mesh));
  }
  gl::set(program, "world_from_mesh", item.W_from_mesh);
  gl::set(program, "normal_matrix",
          Eigen::Matrix3f(item.W_from_mesh.topLeftCorner<3, 3>().inverse().transpose()));
  gl::set(program, "colour", with_opacity(item.colour, item.opacity));
  gl::set(program, "own_light", item.own_light);
  const Eigen::Vector3f middle_m = (item.W_from_mesh * body.middle_m.homogeneous()).head<3>();
  const float nearest_m =
      std::max(1e-3F * static_cast<float>(scale_), (middle_m - view.eye_m).norm() - body.radius_m * scale);
  const gl::Mesh& mesh = body.seen_at(scale / nearest_m * view.pixels_per_radian);
  mesh.draw();
  return mesh.index_count / 3;
}

}  // namespace phantom::synthetic_viewer
