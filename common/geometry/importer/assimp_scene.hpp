#pragma once

// Private to the importer: a file as assimp's scene, of which shape and nodes are known to be sound.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

struct aiScene;
namespace Assimp {
class Importer;
}

namespace phantom::geometry::detail {

/// Reads the file's triangles and nodes; `importer` owns the scene. Faces name existing vertices; nodes may
/// still lack children or name meshes that do not exist. What the file says of materials, lights, cameras,
/// motions is not looked at: a flaw there is no reason to refuse a shape. Null, and why in `problem`, if it
/// is no mesh file, or if what it is made of would be misread. `notes`: what was left out of the shape is
/// added. `max_memory_bytes`: for the message. May crash or hang on malformed files. Not thread-safe.
const aiScene* read_scene(Assimp::Importer& importer, const std::filesystem::path& path,
                          std::uint64_t max_memory_bytes, std::vector<std::string>& notes,
                          std::string& problem);

}  // namespace phantom::geometry::detail
