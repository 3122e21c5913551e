#include "components/synthetic_viewer/render/gl_objects.hpp"

#include <array>
#include <stdexcept>
#include <string>

namespace phantom::synthetic_viewer::gl {
namespace {

GLuint compile(GLenum kind, const char* source, const char* defines) {
  const std::string text = source;
  const std::size_t line = text.find('\n') + 1;
  const std::string whole = text.substr(0, line) + defines + text.substr(line);
  const char* start = whole.c_str();
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &start, nullptr);
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

void attach_buffer(GLenum format, GLenum attachment, int width_px, int height_px, int samples) {
  GLuint buffer = 0;
  glGenRenderbuffers(1, &buffer);
  glBindRenderbuffer(GL_RENDERBUFFER, buffer);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, width_px, height_px);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
}

}  // namespace

GLuint link_program(const char* vertex_source, const char* fragment_source, const char* defines) {
  const GLuint vertex = compile(GL_VERTEX_SHADER, vertex_source, defines);
  const GLuint fragment = compile(GL_FRAGMENT_SHADER, fragment_source, defines);
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
void set(GLuint program, const char* name, const Eigen::Matrix3f& value) {
  glUniformMatrix3fv(glGetUniformLocation(program, name), 1, GL_FALSE, value.data());
}
void set(GLuint program, const char* name, const Eigen::Vector4f& value) {
  glUniform4fv(glGetUniformLocation(program, name), 1, value.data());
}
void set(GLuint program, const char* name, const Eigen::Vector3f& value) {
  glUniform3fv(glGetUniformLocation(program, name), 1, value.data());
}
void set(GLuint program, const char* name, float value) {
  glUniform1f(glGetUniformLocation(program, name), value);
}

Mesh Mesh::make(const ShadedMesh& source) {
  Mesh mesh;
  mesh.index_count = static_cast<GLsizei>(source.indices.size());
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
  return mesh;
}

void Mesh::draw() const {
  glBindVertexArray(vertex_array);
  glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
}

void Mesh::drop() const {
  const std::array<GLuint, 2> buffers{vertices, indices};
  glDeleteVertexArrays(1, &vertex_array);
  glDeleteBuffers(2, buffers.data());
}

Body Body::make(const ShadedMesh& source) {
  Body body;
  geometry::BoundingBox box;
  for (const ShadedMesh::Vertex& v : source.vertices)
    box.extend(Eigen::Map<const Eigen::Vector3f>(v.position_m.data()));
  if (!box.empty()) {
    body.middle_m = (box.min_m + box.max_m) / 2;
    body.radius_m = (box.max_m - box.min_m).norm() / 2;
  }
  body.levels.push_back({0.0, Mesh::make(source)});
  return body;
}

// A level merges the vertices within a cube of its pitch. It is kept if that saves enough triangles.
Body Body::with_levels(const geometry::TriangleMesh& mesh, double scale) {
  constexpr double kShadowPitch_m = 0.03;
  constexpr std::size_t kMinForLevels = 2000;  // triangles
  constexpr double kWorthALevel = 0.6;
  Body body = make(shade(mesh));
  body.shadow = Mesh::make(shade(coarsen(mesh, scale * kShadowPitch_m)));
  if (mesh.triangles.size() < kMinForLevels) return body;
  double last = static_cast<double>(mesh.triangles.size());
  for (const double usual_m : {0.0015, 0.004, 0.010}) {
    const double pitch_m = scale * usual_m;
    const geometry::TriangleMesh coarse = coarsen(mesh, pitch_m);
    if (static_cast<double>(coarse.triangles.size()) > kWorthALevel * last) continue;
    last = static_cast<double>(coarse.triangles.size());
    body.levels.push_back({pitch_m, Mesh::make(shade(coarse))});
  }
  return body;
}

const Mesh& Body::seen_at(float pixels_per_m) const {
  constexpr float kUnseen_px = 0.9F;  // side of a level's cubes
  const Level* level = &levels.front();
  for (const Level& coarser : levels)
    if (static_cast<float>(coarser.pitch_m) * pixels_per_m < kUnseen_px) level = &coarser;
  return level->mesh;
}

void Body::drop() const {
  for (const Level& level : levels) level.mesh.drop();
  shadow.drop();
}

Target::Target(int width_px, int height_px, int samples) {
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  attach_buffer(GL_RGBA8, GL_COLOR_ATTACHMENT0, width_px, height_px, samples);
  attach_buffer(GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT, width_px, height_px, samples);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("the OpenGL driver cannot draw pictures of " + std::to_string(width_px) + " x " +
                             std::to_string(height_px) + " with " + std::to_string(samples) + " samples");
  }
  if (samples == 1) return;
  glGenFramebuffers(1, &plain_frame);
  glBindFramebuffer(GL_FRAMEBUFFER, plain_frame);
  attach_buffer(GL_RGBA8, GL_COLOR_ATTACHMENT0, width_px, height_px, 1);
}

void Paint::load(const PaintVolume& volume) {
  if (texture == 0) glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_3D, texture);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum side : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(GL_TEXTURE_3D, side, GL_CLAMP_TO_EDGE);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R8, volume.size[0], volume.size[1], volume.size[2], 0, GL_RED,
               GL_UNSIGNED_BYTE, volume.closeness.data());
  texture_from_paint.setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    const float extent_m = volume.edge_m * static_cast<float>(volume.size[static_cast<std::size_t>(axis)]);
    texture_from_paint(axis, axis) = 1 / extent_m;
    texture_from_paint(axis, 3) = -volume.corner_m[axis] / extent_m;
  }
}

}  // namespace phantom::synthetic_viewer::gl
