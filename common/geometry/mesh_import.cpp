#include "common/geometry/mesh_import.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <unordered_map>

namespace phantom::geometry::detail {
namespace {

/// Collects triangles in metres and gives equal corners one vertex.
class MeshBuilder {
 public:
  explicit MeshBuilder(const MeshImportOptions& options) : options_(options) {}

  std::uint32_t vertex(const aiVector3D& file_units, const aiMatrix4x4t<double>& to_root) {
    const aiVector3t<double> p = to_root * aiVector3t<double>(file_units.x, file_units.y, file_units.z);
    const Eigen::Vector3d z_up =
        options_.y_up ? Eigen::Vector3d(p.x, -p.z, p.y) : Eigen::Vector3d(p.x, p.y, p.z);
    Eigen::Vector3f position_m = (options_.scale * z_up).cast<float>();
    finite_ = finite_ && position_m.allFinite();
    position_m.array() += 0.0F;  // −0 and 0 are one place
    const auto [entry, is_new] =
        known_.try_emplace(position_m, static_cast<std::uint32_t>(mesh_.vertices_m.size()));
    if (is_new) mesh_.vertices_m.push_back(position_m);
    return entry->second;
  }

  bool finite() const { return finite_; }
  TriangleMesh& mesh() { return mesh_; }

 private:
  struct HashBits {
    std::size_t operator()(const Eigen::Vector3f& v) const {
      std::uint32_t bits[3];
      std::memcpy(bits, v.data(), sizeof bits);
      std::uint64_t h = bits[0] * 0x9e3779b97f4a7c15ULL;
      h = (h ^ (h >> 32) ^ bits[1]) * 0xff51afd7ed558ccdULL;
      h = (h ^ (h >> 32) ^ bits[2]) * 0xc4ceb9fe1a85ec53ULL;
      return h ^ (h >> 29);
    }
  };
  const MeshImportOptions& options_;
  TriangleMesh mesh_;
  std::unordered_map<Eigen::Vector3f, std::uint32_t, HashBits> known_;
  bool finite_ = true;
};

bool add_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4t<double>& to_root,
              MeshBuilder& builder, const MeshImportOptions& options, std::string& problem) {
  const aiMatrix4x4t<double> here = to_root * aiMatrix4x4t<double>(node.mTransformation);
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[node.mMeshes[m]];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      if (builder.mesh().triangles.size() >= options.max_triangles) {
        problem = "has more than " + std::to_string(options.max_triangles) + " triangles";
        return false;
      }
      std::array<std::uint32_t, 3> corners{};
      for (unsigned i = 0; i < 3; ++i) {
        if (face.mIndices[i] >= part.mNumVertices) {
          problem = "has a triangle that names a vertex which does not exist";
          return false;
        }
        corners[i] = builder.vertex(part.mVertices[face.mIndices[i]], here);
      }
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) {
        builder.mesh().triangles.push_back(corners);
      }
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    if (!add_node(scene, *node.mChildren[c], here, builder, options, problem)) return false;
  }
  return true;
}

}  // namespace

bool import_mesh_unguarded(const std::filesystem::path& path, const MeshImportOptions& options,
                           TriangleMesh& mesh, std::string& problem) {
  Assimp::Importer importer;
  // Only shape matters here. Normals and the like would also keep equal vertices apart.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS |
                                  aiComponent_MATERIALS);
  const aiScene* scene = importer.ReadFile(
      path.string(), aiProcess_ValidateDataStructure | aiProcess_RemoveComponent | aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    problem = std::string("is not a readable mesh: ") + importer.GetErrorString();
    return false;
  }
  MeshBuilder builder(options);
  if (!add_node(*scene, *scene->mRootNode, aiMatrix4x4t<double>(), builder, options, problem)) return false;
  if (!builder.finite()) {
    problem = "has a coordinate that is not a finite number";
    return false;
  }
  if (builder.mesh().triangles.empty()) {
    problem = "holds no triangles";
    return false;
  }
  mesh = std::move(builder.mesh());
  return true;
}

}  // namespace phantom::geometry::detail
