#include "common/geometry/importer/gltf_shape.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace phantom::geometry::detail {
namespace {

using nlohmann::json;

constexpr unsigned kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6;  // primitive.mode

/// Returns `parent[key][index]` if there is such an object, else null.
const json* element(const json& parent, const char* key, std::uint64_t index) {
  const auto list = parent.find(key);
  if (list == parent.end() || !list->is_array() || index >= list->size()) return nullptr;
  const json& found = (*list)[index];
  return found.is_object() ? &found : nullptr;
}

/// Returns a whole number from 0 on; nothing if it is something else.
std::optional<std::uint64_t> index_of(const json& value) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  if (!value.is_number_integer() || value.get<std::int64_t>() < 0) return std::nullopt;
  return static_cast<std::uint64_t>(value.get<std::int64_t>());
}
std::optional<std::uint64_t> number(const json& parent, const char* key) {
  const auto found = parent.find(key);
  return found == parent.end() ? std::nullopt : index_of(*found);
}

class Counter {
 public:
  Counter(const json& gltf, GltfShape& shape) : gltf_(gltf), shape_(shape) {
    shape_.triangles = 0;
    shape_.bounded = true;
    std::fill(shape_.low, shape_.low + 3, INFINITY);
    std::fill(shape_.high, shape_.high + 3, -INFINITY);
  }
  /// Adds a list of nodes' numbers. Returns false if it is damaged or too large to be counted.
  bool add_nodes(const json& indices, int depth) {
    if (!indices.is_array() || depth > kMaxDepth) return false;
    return std::all_of(indices.begin(), indices.end(), [&](const json& index) {
      const auto node = index_of(index);
      return node && add_node(*node, depth);
    });
  }

 private:
  static constexpr int kMaxDepth = 500, kMaxNodes = 1'000'000;

  bool add_node(std::uint64_t index, int depth) {
    const json* node = element(gltf_, "nodes", index);
    if (node == nullptr || ++nodes_ > kMaxNodes) return false;
    if (const auto mesh = number(*node, "mesh"); mesh && !add_mesh(*mesh)) return false;
    const auto children = node->find("children");
    return children == node->end() || add_nodes(*children, depth + 1);
  }

  bool add_mesh(std::uint64_t index) {
    const json* mesh = element(gltf_, "meshes", index);
    const auto primitives = mesh == nullptr ? json::const_iterator() : mesh->find("primitives");
    if (mesh == nullptr || primitives == mesh->end() || !primitives->is_array()) return false;
    return std::all_of(primitives->begin(), primitives->end(),
                       [&](const json& primitive) { return primitive.is_object() && add(primitive); });
  }

  bool add(const json& primitive) {
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->is_object()) return false;
    const auto position = number(*attributes, "POSITION");
    if (!position) return true;  // without a shape
    const json* corners = element(gltf_, "accessors", *position);
    const auto indices = number(primitive, "indices");
    const json* counted = indices ? element(gltf_, "accessors", *indices) : corners;
    const auto count = counted == nullptr ? std::nullopt : number(*counted, "count");
    if (corners == nullptr || !count || *count > UINT32_MAX) return false;
    bound(*corners);
    const std::uint64_t mode = number(primitive, "mode").value_or(kTriangles);
    if (mode == kTriangles) *shape_.triangles += *count / 3;
    if (mode == kTriangleStrip || mode == kTriangleFan)
      *shape_.triangles += *count - std::min<std::uint64_t>(*count, 2);
    return true;
  }

  void bound(const json& corners) {
    const auto take = [&](const char* key, double* bound, auto choose) {
      const auto found = corners.find(key);
      const bool known = found != corners.end() && found->is_array() && found->size() == 3;
      for (std::size_t i = 0; i < 3; ++i) {
        if (!known || !(*found)[i].is_number())
          shape_.bounded = false;
        else
          bound[i] = choose(bound[i], (*found)[i].get<double>());
      }
    };
    take("min", shape_.low, [](double a, double b) { return std::min(a, b); });
    take("max", shape_.high, [](double a, double b) { return std::max(a, b); });
  }

  const json& gltf_;
  GltfShape& shape_;
  int nodes_ = 0;
};

/// Calls visit(mesh) for each mesh of each node, as often as it stands in the scene.
template <class Visit>
void for_each_mesh(const aiScene& scene, const aiNode& node, const Visit& visit) {
  for (unsigned m = 0; m < node.mNumMeshes; ++m)
    if (node.mMeshes[m] < scene.mNumMeshes) visit(*scene.mMeshes[node.mMeshes[m]]);
  for (unsigned c = 0; c < node.mNumChildren; ++c)
    if (node.mChildren[c] != nullptr) for_each_mesh(scene, *node.mChildren[c], visit);
}

}  // namespace

GltfShape declared_shape(const json& gltf, std::vector<std::string>& notes) {
  GltfShape shape;
  const std::uint64_t which = number(gltf, "scene").value_or(0);
  const json* scene = element(gltf, "scenes", which);
  if (scene == nullptr) return shape;
  if (const std::size_t count = gltf["scenes"].size(); count > 1)
    notes.push_back("has " + std::to_string(count) + " scenes, of which number " + std::to_string(which) +
                    " is read");
  const auto nodes = scene->find("nodes");
  if (nodes == scene->end() || !Counter(gltf, shape).add_nodes(*nodes, 0)) return {};
  return shape;
}

std::string compare_with(const GltfShape& declared, const aiScene& scene, std::vector<std::string>& notes) {
  if (!declared.triangles) return {};
  std::uint64_t triangles = 0;
  double extent = 0.0, farthest = 0.0, beyond = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    extent = std::max(extent, declared.high[i] - declared.low[i]);
    farthest = std::max({farthest, std::abs(declared.low[i]), std::abs(declared.high[i])});
  }
  for_each_mesh(scene, *scene.mRootNode, [&](const aiMesh& mesh) {
    triangles += static_cast<std::uint64_t>(std::count_if(
        mesh.mFaces, mesh.mFaces + mesh.mNumFaces, [](const aiFace& face) { return face.mNumIndices == 3; }));
    for (unsigned v = 0; declared.bounded && v < mesh.mNumVertices; ++v)
      for (unsigned i = 0; i < 3; ++i) {
        const double at = static_cast<double>(mesh.mVertices[v][i]);
        beyond = std::max({beyond, declared.low[i] - at, at - declared.high[i]});
      }
  });
  if (triangles != *declared.triangles)
    return "declares " + std::to_string(*declared.triangles) + " triangles, of which " +
           std::to_string(triangles) + " were read: export it again, or as another format";
  if (beyond > 0.01 * extent + 1e-6 * farthest)
    notes.push_back("has corners that lie " + std::to_string(beyond) +
                    " of its units beyond the bounds that it declares: compare it with its source");
  return {};
}

}  // namespace phantom::geometry::detail
