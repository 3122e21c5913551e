#pragma once

// Private to the importer: reads a file as an assimp scene with sound shape and nodes.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

struct aiScene;
namespace Assimp {
class Importer;
}

namespace phantom::geometry::detail {

/// Reads the file's triangles and nodes into a scene that `importer` owns. Faces name existing vertices;
/// nodes may still lack children or name meshes that do not exist. Materials, lights, cameras and animations
/// are ignored, so that an error in them does not make a shape unusable. Returns null, with the reason in
/// `problem`, if the file is not a mesh or would be misread. Adds what was left out of the shape to `notes`.
/// `max_memory_bytes`: for the message. May crash or hang on malformed files. Not thread-safe.
const aiScene* read_scene(Assimp::Importer& importer, const std::filesystem::path& path,
                          std::uint64_t max_memory_bytes, std::vector<std::string>& notes,
                          std::string& problem);

}  // namespace phantom::geometry::detail
