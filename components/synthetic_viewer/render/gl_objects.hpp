#pragma once

// OpenGL objects of the renderer. Used by renderer.cpp only; a context must be current for every call, and
// destroys them with itself.

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <vector>

#include "components/synthetic_viewer/render/shaded_mesh.hpp"
#include "components/synthetic_viewer/render/skin_paint.hpp"

namespace phantom::synthetic_viewer::gl {

/// Compiles and links a program; `defines` is inserted after the #version line of both shaders. Throws
/// std::runtime_error with the driver's message.
GLuint link_program(const char* vertex_source, const char* fragment_source, const char* defines = "");

// Set a uniform of the program in use.
void set(GLuint program, const char* name, const Eigen::Matrix4f& value);
void set(GLuint program, const char* name, const Eigen::Matrix3f& value);
void set(GLuint program, const char* name, const Eigen::Vector4f& value);
void set(GLuint program, const char* name, const Eigen::Vector3f& value);
void set(GLuint program, const char* name, float value);

/// Indexed triangles in the graphics card's memory.
struct Mesh {
  GLuint vertex_array = 0, vertices = 0, indices = 0;
  GLsizei index_count = 0;

  static Mesh make(const ShadedMesh& source);
  void draw() const;
  void drop() const;
};

/// What is drawn of a mesh: itself, coarser versions of it, and its shadow.
struct Body {
  struct Level {
    double pitch_m;  // 0: the mesh itself
    Mesh mesh;
  };
  std::vector<Level> levels;                           // finest first
  Mesh shadow;                                         // without indices: casts none
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  // centre of its bounding sphere, in the mesh's frame
  float radius_m = 0.0F;

  /// A mesh alone.
  static Body make(const ShadedMesh& source);
  /// With coarser levels, for scenes of that scale.
  static Body with_levels(const geometry::TriangleMesh& mesh, double scale);
  /// Returns the coarsest level that looks like the mesh where a metre of it takes so many pixels.
  const Mesh& seen_at(float pixels_per_m) const;
  void drop() const;
};

/// Buffers that a picture is drawn into. With several samples per pixel, there is a second pair into which
/// they are averaged.
struct Target {
  GLuint frame = 0, plain_frame = 0;

  /// Creates the buffers. Throws std::runtime_error if the driver cannot.
  Target(int width_px, int height_px, int samples);
};

/// A paint volume as a texture, and the matrix from its frame to texture coordinates.
struct Paint {
  GLuint texture = 0;
  Eigen::Matrix4f texture_from_paint = Eigen::Matrix4f::Identity();

  void load(const PaintVolume& volume);
};

}  // namespace phantom::synthetic_viewer::gl
