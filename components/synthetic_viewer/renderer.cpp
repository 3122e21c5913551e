#include "components/synthetic_viewer/renderer.hpp"

#include <epoxy/gl.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

#include "components/synthetic_viewer/shaders.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr float kFloorBorder_m = 0.5F;
constexpr double kShadowPitch_m = 0.03;
// Towards the key light, as in the mesh shader; shadows fall along it.
const Eigen::Vector3f kToKeyLight(0.348F, -0.464F, 0.815F);

GLuint compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good == 0) {
    std::array<char, 1024> log{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw std::runtime_error(std::string("the OpenGL driver refuses a shader: ") + log.data());
  }
  return shader;
}

GLuint link(const char* vertex_source, const char* fragment_source) {
  const GLuint vertex = compile(GL_VERTEX_SHADER, vertex_source);
  const GLuint fragment = compile(GL_FRAGMENT_SHADER, fragment_source);
  const GLuint program = glCreateProgram();
  glAttachShader(program, vertex);
  glAttachShader(program, fragment);
  glLinkProgram(program);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  GLint good = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &good);
  if (good == 0) throw std::runtime_error("the OpenGL driver cannot link a shader program");
  return program;
}

void set(GLuint program, const char* name, const Eigen::Matrix4f& value) {
  glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, value.data());
}
void set(GLuint program, const char* name, const Eigen::Vector3f& value) {
  glUniform3fv(glGetUniformLocation(program, name), 1, value.data());
}

/// Flattens along the key light onto the plane z = floor_z.
Eigen::Matrix4f shadow_matrix(float floor_z) {
  const Eigen::Vector3f slope = kToKeyLight / kToKeyLight.z();
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix(0, 2) = -slope.x();
  matrix(1, 2) = -slope.y();
  matrix(2, 2) = 0;
  matrix(0, 3) = slope.x() * floor_z;
  matrix(1, 3) = slope.y() * floor_z;
  matrix(2, 3) = floor_z;
  return matrix;
}

void attach_buffer(GLuint& buffer, GLenum format, GLenum attachment, const PictureFormat& picture,
                   int samples) {
  glGenRenderbuffers(1, &buffer);
  glBindRenderbuffer(GL_RENDERBUFFER, buffer);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, picture.width_px,
                                   picture.height_px);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
}

}  // namespace

Eigen::Matrix4f matrix_of(const geometry::Pose& X_WM, const Eigen::Vector3d& scale) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.topLeftCorner<3, 3>() = (X_WM.rotation * scale.asDiagonal()).cast<float>();
  matrix.topRightCorner<3, 1>() = X_WM.translation_m.cast<float>();
  return matrix;
}

struct Renderer::Programs {
  GLuint mesh = link(shaders::kMeshVertex, shaders::kMeshFragment);
  GLuint flat = link(shaders::kFlatVertex, shaders::kFlatFragment);
  GLuint background = link(shaders::kBackgroundVertex, shaders::kBackgroundFragment);
  GLuint floor = link(shaders::kFloorVertex, shaders::kFloorFragment);
  GLint world_from_mesh = glGetUniformLocation(mesh, "world_from_mesh");
  GLint normal_matrix = glGetUniformLocation(mesh, "normal_matrix");
  GLint colour = glGetUniformLocation(mesh, "colour");
  GLint own_light = glGetUniformLocation(mesh, "own_light");
  GLuint empty_array = 0, line_array = 0, line_buffer = 0;
};

/// Buffers that a picture is drawn into; with several samples per pixel, a second pair to average them in.
struct Renderer::Target {
  GLuint frame = 0, colour = 0, depth = 0;
  GLuint plain_frame = 0, plain_colour = 0;

  Target(const PictureFormat& format, int samples) {
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    attach_buffer(colour, GL_RGBA8, GL_COLOR_ATTACHMENT0, format, samples);
    attach_buffer(depth, GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT, format, samples);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw std::runtime_error("the OpenGL driver cannot draw pictures of " +
                               std::to_string(format.width_px) + " x " + std::to_string(format.height_px) +
                               " with " + std::to_string(samples) + " samples");
    }
    if (samples == 1) return;
    glGenFramebuffers(1, &plain_frame);
    glBindFramebuffer(GL_FRAMEBUFFER, plain_frame);
    attach_buffer(plain_colour, GL_RGBA8, GL_COLOR_ATTACHMENT0, format, 1);
  }
  ~Target() {
    const std::array<GLuint, 2> frames{frame, plain_frame};
    const std::array<GLuint, 3> buffers{colour, depth, plain_colour};
    glDeleteFramebuffers(static_cast<GLsizei>(frames.size()), frames.data());
    glDeleteRenderbuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  }
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;
};

Renderer::Renderer(GraphicsPlatform platform) : context_(platform), programs_(std::make_unique<Programs>()) {
  meshes_[kCone] = make_mesh(unit_cone());
  meshes_[kCylinder] = make_mesh(unit_cylinder());
  meshes_[kSphere] = make_mesh(unit_sphere());
  meshes_[kDisc] = make_mesh(unit_disc());
  glGenVertexArrays(1, &programs_->empty_array);
  glGenVertexArrays(1, &programs_->line_array);
  glGenBuffers(1, &programs_->line_buffer);
  glBindVertexArray(programs_->line_array);
  glBindBuffer(GL_ARRAY_BUFFER, programs_->line_buffer);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
}

Renderer::~Renderer() = default;  // the context takes its objects with it

Renderer::Mesh Renderer::make_mesh(const ShadedMesh& source) {
  Mesh mesh;
  mesh.index_count = static_cast<int>(source.indices.size());
  glGenVertexArrays(1, &mesh.vertex_array);
  glGenBuffers(1, &mesh.vertices);
  glGenBuffers(1, &mesh.indices);
  glBindVertexArray(mesh.vertex_array);
  glBindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(source.vertices.size() * sizeof(ShadedMesh::Vertex)),
               source.vertices.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(source.indices.size() * sizeof(std::uint32_t)), source.indices.data(),
               GL_STATIC_DRAW);
  constexpr GLsizei kStride = sizeof(ShadedMesh::Vertex);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, kStride,
                        reinterpret_cast<const void*>(offsetof(ShadedMesh::Vertex, normal)));
  glBindVertexArray(0);
  geometry::BoundingBox box;
  for (const ShadedMesh::Vertex& v : source.vertices)
    box.extend(Eigen::Map<const Eigen::Vector3f>(v.position_m.data()));
  if (!box.empty()) {
    mesh.middle_m = (box.min_m + box.max_m) / 2;
    mesh.radius_m = (box.max_m - box.min_m).norm() / 2;
  }
  return mesh;
}

MeshHandle Renderer::upload(const geometry::TriangleMesh& mesh) {
  meshes_[next_handle_] = make_mesh(shade(mesh));
  shadow_meshes_[next_handle_] = make_mesh(shade(coarsen(mesh, kShadowPitch_m)));
  return next_handle_++;
}

void Renderer::drop(const Mesh& mesh) {
  const std::array<GLuint, 2> buffers{mesh.vertices, mesh.indices};
  glDeleteVertexArrays(1, &mesh.vertex_array);
  glDeleteBuffers(2, buffers.data());
}

void Renderer::drop(MeshHandle handle) {
  for (auto* meshes : {&meshes_, &shadow_meshes_}) {
    const auto found = meshes->find(handle);
    if (found == meshes->end()) continue;
    drop(found->second);
    meshes->erase(found);
  }
}

Renderer::Target& Renderer::target_for(const PictureFormat& format) {
  GLint most = 1;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  const int samples = std::clamp(format.samples, 1, std::max(1, static_cast<int>(most)));
  const std::uint64_t key = static_cast<std::uint64_t>(format.width_px) << 32 |
                            static_cast<std::uint64_t>(format.height_px) << 8 |
                            static_cast<std::uint64_t>(samples);
  auto& target = targets_[key];
  if (!target) target = std::make_unique<Target>(format, samples);
  return *target;
}

Image Renderer::render(const Frame& frame, const PictureFormat& format) {
  Target& target = target_for(format);
  const double aspect = static_cast<double>(format.width_px) / format.height_px;
  // OpenGL's rows run upwards. Drawing the picture upside down (and turning the sense of front faces) makes
  // them come back in the order of images, without a copy.
  Eigen::Matrix4f clip_from_W =
      (projection_matrix(frame.camera, aspect) * view_matrix(frame.camera)).cast<float>();
  clip_from_W.row(1) *= -1.0F;
  glBindFramebuffer(GL_FRAMEBUFFER, target.frame);
  glViewport(0, 0, format.width_px, format.height_px);
  glFrontFace(GL_CW);
  glEnable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  draw_background();
  draw_floor(frame, clip_from_W);
  if (format.shadows) draw_shadows(frame, clip_from_W);
  draw_lines(frame, clip_from_W);
  draw_items(frame, clip_from_W);
  if (target.plain_frame != 0) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target.frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.plain_frame);
    glBlitFramebuffer(0, 0, format.width_px, format.height_px, 0, 0, format.width_px, format.height_px,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target.plain_frame);
  }
  Image image{format.width_px, format.height_px, {}};
  image.bgr.resize(3 * static_cast<std::size_t>(format.width_px) *
                   static_cast<std::size_t>(format.height_px));
  glReadPixels(0, 0, format.width_px, format.height_px, GL_BGR, GL_UNSIGNED_BYTE, image.bgr.data());
  return image;
}

void Renderer::draw_background() const {
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glUseProgram(programs_->background);
  glBindVertexArray(programs_->empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_CULL_FACE);
}

void Renderer::draw_floor(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const {
  if (!(frame.floor_max_m.x() > frame.floor_min_m.x())) return;
  glEnable(GL_BLEND);
  glUseProgram(programs_->floor);
  set(programs_->floor, "clip_from_world", clip_from_W);
  set(programs_->floor, "least", frame.floor_min_m);
  set(programs_->floor, "greatest", frame.floor_max_m);
  glUniform1f(glGetUniformLocation(programs_->floor, "border"), kFloorBorder_m);
  glBindVertexArray(programs_->empty_array);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

void Renderer::draw_shadows(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const {
  // Seen from below, the floor is not there; neither are the shadows on it.
  if (frame.camera.eye_m.z() <= frame.floor_min_m.z() || !(frame.floor_max_m.x() > frame.floor_min_m.x()))
    return;
  const Eigen::Matrix4f flatten = clip_from_W * shadow_matrix(frame.floor_min_m.z());
  glEnable(GL_BLEND);
  glDisable(GL_CULL_FACE);    // the stand-ins are not closed
  glEnable(GL_STENCIL_TEST);  // so that overlapping shadows do not darken twice
  glStencilFunc(GL_EQUAL, 0, 0xFF);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
  glUseProgram(programs_->flat);
  glUniform4f(glGetUniformLocation(programs_->flat, "colour"), 0.0F, 0.0F, 0.0F, 0.33F);
  for (const DrawItem& item : frame.items) {
    const auto found = shadow_meshes_.find(item.mesh);
    if (!item.casts_shadow || found == shadow_meshes_.end()) continue;
    set(programs_->flat, "clip_from_mesh", Eigen::Matrix4f(flatten * item.W_from_mesh));
    glBindVertexArray(found->second.vertex_array);
    glDrawElements(GL_TRIANGLES, found->second.index_count, GL_UNSIGNED_INT, nullptr);
  }
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void Renderer::draw_lines(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const {
  if (frame.lines.empty()) return;
  static_assert(sizeof(Line) == 6 * sizeof(float));
  glEnable(GL_DEPTH_TEST);
  glUseProgram(programs_->flat);
  set(programs_->flat, "clip_from_mesh", clip_from_W);
  const Colour& c = frame.line_colour;
  glUniform4f(glGetUniformLocation(programs_->flat, "colour"), c[0], c[1], c[2], 1.0F);
  glBindVertexArray(programs_->line_array);
  glBindBuffer(GL_ARRAY_BUFFER, programs_->line_buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(frame.lines.size() * sizeof(Line)),
               frame.lines.data(), GL_STREAM_DRAW);
  glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(2 * frame.lines.size()));
}

void Renderer::draw_items(const Frame& frame, const Eigen::Matrix4f& clip_from_W) const {
  glEnable(GL_DEPTH_TEST);
  glUseProgram(programs_->mesh);
  set(programs_->mesh, "clip_from_world", clip_from_W);
  set(programs_->mesh, "eye", Eigen::Vector3f(frame.camera.eye_m.cast<float>()));
  std::vector<const DrawItem*> see_through;
  for (const DrawItem& item : frame.items) {
    if (!in_sight(item, clip_from_W)) continue;
    if (item.opacity >= 1.0F) {
      draw_item(item);
    } else {
      see_through.push_back(&item);
    }
  }
  const Eigen::Vector3f eye = frame.camera.eye_m.cast<float>();
  std::sort(see_through.begin(), see_through.end(), [&eye](const DrawItem* a, const DrawItem* b) {
    return (a->W_from_mesh.topRightCorner<3, 1>() - eye).squaredNorm() >
           (b->W_from_mesh.topRightCorner<3, 1>() - eye).squaredNorm();
  });
  glEnable(GL_BLEND);
  glDepthMask(GL_FALSE);
  for (const DrawItem* item : see_through) draw_item(*item);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

/// False if a ball around the item lies outside one of the picture's borders. Spares transforming its
/// vertices.
bool Renderer::in_sight(const DrawItem& item, const Eigen::Matrix4f& clip_from_W) const {
  const auto found = meshes_.find(item.mesh);
  if (found == meshes_.end()) return false;
  const Eigen::Vector4f middle = item.W_from_mesh * found->second.middle_m.homogeneous();
  const float radius =
      found->second.radius_m * item.W_from_mesh.topLeftCorner<3, 3>().colwise().norm().maxCoeff();
  for (int border = 0; border < 4; ++border) {  // clip w ± clip x, y ≥ 0 inside
    const Eigen::RowVector4f plane =
        clip_from_W.row(3) + (border % 2 == 0 ? 1.0F : -1.0F) * clip_from_W.row(border / 2);
    if (plane.dot(middle) < -radius * plane.head<3>().norm()) return false;
  }
  return true;
}

void Renderer::draw_item(const DrawItem& item) const {
  const auto found = meshes_.find(item.mesh);
  if (found == meshes_.end()) return;
  const Eigen::Matrix3f normals = item.W_from_mesh.topLeftCorner<3, 3>().inverse().transpose();
  glUniformMatrix4fv(programs_->world_from_mesh, 1, GL_FALSE, item.W_from_mesh.data());
  glUniformMatrix3fv(programs_->normal_matrix, 1, GL_FALSE, normals.data());
  glUniform4f(programs_->colour, item.colour[0], item.colour[1], item.colour[2], item.opacity);
  glUniform1f(programs_->own_light, item.own_light);
  glBindVertexArray(found->second.vertex_array);
  glDrawElements(GL_TRIANGLES, found->second.index_count, GL_UNSIGNED_INT, nullptr);
}

}  // namespace phantom::synthetic_viewer
