#pragma once

// Private to the importer: reads a mesh file of any format as one mesh.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"

struct aiScene;
namespace Assimp {
class Importer;
}

namespace phantom::geometry::detail {

struct GltfShape;

/// Reads the file as load_mesh() describes, but in this process. On failure returns false with the reason in
/// `problem` (without the file's name). May crash or hang on malformed files, and throw std::bad_alloc.
bool import_mesh(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                 std::string& problem);

/// Reads the file's triangles and nodes into a scene that `importer` owns. Faces name existing vertices;
/// nodes may still lack children or name meshes that do not exist. Materials, lights, cameras and animations
/// are ignored, so that an error in them does not make a shape unusable. Returns null, with the reason in
/// `problem`, if the file is not a mesh or would be misread. Adds what was left out of the shape to `notes`.
/// `max_memory_bytes`: for the message. May crash or hang on malformed files. Not thread-safe.
const aiScene* read_scene(Assimp::Importer& importer, const std::filesystem::path& path,
                          std::uint64_t max_memory_bytes, std::vector<std::string>& notes,
                          std::string& problem);

/// Returns why the glTF 2 file (.gltf, .glb) would be misread, in a sentence without the file's name: it
/// depends on an extension that is not read, or a buffer is not there. Empty if nothing is found, or the file
/// has another format. Adds what of its shape is not applied to `notes`. `shape`: what it declares.
std::string check_gltf(const std::filesystem::path& path, std::vector<std::string>& notes, GltfShape& shape);

/// Returns why a file of AMF, X3D, COLLADA or DXF would be misread, in a sentence without the file's name:
/// its importer leaves parts of such files out, or moves them, without a word. Empty if nothing is found, or
/// the file has another format.
std::string check_lossy_format(const std::filesystem::path& path);

/// Returns what a URI's escapes stand for: "part%20one.bin" is "part one.bin".
std::string decoded_uri(std::string_view uri);

/// Relates the scene's coordinates to the file's: p_file = to_file · p_scene, a rotation and a scale.
struct SceneFrame {
  std::string format;  ///< the importer's name for the format
  DeclaredFrame declared;
  Eigen::Matrix3d to_file = Eigen::Matrix3d::Identity();
};

SceneFrame scene_frame(const aiScene& scene, const std::filesystem::path& path);

}  // namespace phantom::geometry::detail
