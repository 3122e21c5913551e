#pragma once

// Private to the importer: what a glTF file declares of its shape, against what was read of it.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

struct aiScene;

namespace phantom::geometry::detail {

/// What the scene of a glTF 2 file that is read (`scene`, else the first) declares by its accessors.
struct GltfShape {
  std::optional<std::uint64_t> triangles;  ///< of all instances; none: the file does not say, or is damaged
  double low[3] = {}, high[3] = {};        ///< of the corners in their meshes' own coordinates, file's units
  bool bounded = false;                    ///< whether every accessor of corners has `min` and `max`
};

/// Reads it from the parsed file. Adds to `notes` that other scenes are left out. Throws nothing but
/// std::bad_alloc, whatever the JSON holds.
GltfShape declared_shape(const nlohmann::json& gltf, std::vector<std::string>& notes);

/// Compares it with the scene that was read. Returns why that is another shape, in a sentence without the
/// file's name: it has another number of triangles. Empty if nothing is found. Adds to `notes` that corners
/// lie beyond the declared bounds, by more than 1 % of their extent.
std::string compare_with(const GltfShape& declared, const aiScene& scene, std::vector<std::string>& notes);

}  // namespace phantom::geometry::detail
