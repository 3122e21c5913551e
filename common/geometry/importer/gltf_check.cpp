#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/geometry/importer/gltf_shape.hpp"
#include "common/geometry/importer/importer.hpp"
#include "common/geometry/mesh/mesh_import.hpp"
#include "common/geometry/mesh/stand_in.hpp"

namespace phantom::geometry::detail {
namespace {

using nlohmann::json;

/// Returns whether the shape is read correctly although the file requires this extension: assimp supports it,
/// or it concerns appearance and motion only.
bool leaves_shape_true(std::string_view extension) {
  return starts_with_any(extension,
                         {"KHR_draco_mesh_compression", "KHR_materials_", "KHR_texture_", "EXT_texture_",
                          "MSFT_texture_", "KHR_lights_", "EXT_lights_", "KHR_animation_", "KHR_xmp"});
}

/// Returns the JSON text of a .gltf or .glb file; empty if there is none.
std::string json_of(const std::filesystem::path& path) {
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  std::ifstream file(path, std::ios::binary);
  char head[20] = {};  // magic, version, length; length and type of the first chunk
  if (none || !file) return {};
  if (!file.read(head, sizeof head) || std::memcmp(head, "glTF", 4) != 0) {
    file.clear();
    file.seekg(0);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::uint32_t length = 0;
  for (std::size_t i = 4; i-- > 0;) length = length << 8 | static_cast<std::uint8_t>(head[12 + i]);
  if (std::memcmp(head + 16, "JSON", 4) != 0 || length > size) return {};
  std::string text(length, '\0');
  file.read(text.data(), length);
  return file ? text : std::string();
}

/// Returns only what is looked at here.
json parts_of(const std::string& text) {
  const json::parser_callback_t only = [](int depth, json::parse_event_t event, json& parsed) {
    if (depth != 1 || event != json::parse_event_t::key) return true;
    constexpr std::string_view kWanted[] = {
        "extensionsRequired", "extensionsUsed", "buffers", "meshes", "nodes", "skins",
        "accessors",          "scenes",         "scene"};
    return std::ranges::find(kWanted, parsed.get_ref<const std::string&>()) != std::end(kWanted);
  };
  return json::parse(text, only, false);
}

/// Returns an extension on which the shape depends and which assimp ignores; empty if there is none.
std::string unread_extension(const json& gltf) {
  for (const char* list : {"extensionsRequired", "extensionsUsed"}) {
    const json names = gltf.value(list, json::array());
    if (!names.is_array()) continue;
    for (const json& name : names) {
      if (!name.is_string()) continue;
      const auto& extension = name.get_ref<const std::string&>();
      // Other number types and instances of a mesh change the shape even if the file does not require them of
      // a reader.
      const bool shape = extension == "KHR_mesh_quantization" || extension == "EXT_mesh_gpu_instancing";
      if (shape || (std::string_view(list) == "extensionsRequired" && !leaves_shape_true(extension)))
        return extension;
    }
  }
  return {};
}

/// Returns the sentence about a buffer's file that a repository has replaced; empty if there is none.
std::string replaced_buffer(const json& gltf, const std::filesystem::path& folder) {
  const json buffers = gltf.value("buffers", json::array());
  if (!buffers.is_array()) return {};
  for (const json& buffer : buffers) {
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    const auto& uri = buffer["uri"].get_ref<const std::string&>();
    if (uri.starts_with("data:")) continue;
    const std::string what = stand_in_at(folder / decoded_uri(uri));
    if (!what.empty()) return "has the buffer '" + uri + "', which " + what;
  }
  return {};
}

/// Returns whether any of the elements has a number other than 0 in its `weights`.
bool has_weights(const json& elements) {
  if (!elements.is_array()) return false;
  return std::ranges::any_of(elements, [](const json& one) {
    const json weights = one.is_object() ? one.value("weights", json::array()) : json::array();
    return weights.is_array() && std::ranges::any_of(weights, [](const json& weight) {
             return weight.is_number() && weight.get<double>() != 0.0;
           });
  });
}

}  // namespace

std::string decoded_uri(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    const char* digits = uri.data() + i + 1;
    if (uri[i] == '%' && i + 2 < uri.size() &&
        std::from_chars(digits, digits + 2, value, 16).ptr == digits + 2) {
      text += static_cast<char>(value);
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

std::string check_gltf(const std::filesystem::path& path, std::vector<std::string>& notes, GltfShape& shape) {
  if (const std::string format = extension_of(path); format != "gltf" && format != "glb") return {};
  const std::string text = json_of(path);
  if (text.starts_with("\xef\xbb\xbf"))
    return "begins with a byte order mark, which glTF does not allow: save it without (as UTF-8, no BOM)";
  const json gltf = parts_of(text);
  if (!gltf.is_object()) return {};  // not JSON: the importer reports it
  if (const std::string extension = unread_extension(gltf); !extension.empty())
    return "depends on the glTF extension " + extension + ", which is not read: export it without";
  if (std::string replaced = replaced_buffer(gltf, path.parent_path()); !replaced.empty()) return replaced;
  if (has_weights(gltf.value("meshes", json())) || has_weights(gltf.value("nodes", json())))
    notes.emplace_back("has morph targets with weights, which are not applied: its shape is that without");
  if (gltf.contains("skins"))
    notes.emplace_back("has skins, which are not applied: its shape is that of its meshes at their nodes");
  shape = declared_shape(gltf, notes);
  return {};
}

}  // namespace phantom::geometry::detail
