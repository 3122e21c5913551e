#include "common/geometry/mesh_import.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/LU>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "common/geometry/mesh_frame.hpp"

namespace phantom::geometry::detail {
namespace {

using Affine = aiMatrix4x4t<double>;

Eigen::Vector3d at(const Affine& to_scene, const aiVector3D& p) {
  const aiVector3t<double> q = to_scene * aiVector3t<double>(p.x, p.y, p.z);
  return {q.x, q.y, q.z};
}

/// Collects triangles and gives equal corners one vertex.
class MeshBuilder {
 public:
  explicit MeshBuilder(TriangleMesh& mesh) : mesh_(mesh) {}

  std::uint32_t vertex(const Eigen::Vector3d& p_m) {
    Eigen::Vector3f position_m = p_m.cast<float>();
    finite_ = finite_ && position_m.allFinite();
    position_m.array() += 0.0F;  // −0 and 0 are one place
    const auto [entry, is_new] =
        known_.try_emplace(position_m, static_cast<std::uint32_t>(mesh_.vertices_m.size()));
    if (is_new) mesh_.vertices_m.push_back(position_m);
    return entry->second;
  }
  void triangle(const std::array<std::uint32_t, 3>& corners) {
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++collapsed_;
    } else {
      mesh_.triangles.push_back(corners);
    }
  }

  bool finite() const { return finite_; }
  std::size_t collapsed() const { return collapsed_; }

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
  TriangleMesh& mesh_;
  std::unordered_map<Eigen::Vector3f, std::uint32_t, HashBits> known_;
  bool finite_ = true;
  std::size_t collapsed_ = 0;
};

/// Calls visit(corner, corner, corner) with every triangle of the node and its children, in the scene's
/// coordinates and outward where the mesh itself is; false and why if the scene is damaged or too large.
template <class Visit>
bool for_each_triangle(const aiScene& scene, const aiNode& node, const Affine& to_root, std::uint64_t& left,
                       std::string& problem, const Visit& visit) {
  const Affine here = to_root * Affine(node.mTransformation);
  const bool mirrored = aiMatrix3x3t<double>(here).Determinant() < 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[node.mMeshes[m]];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      if (left == 0) {
        problem = "has more triangles than the limit";
        return false;
      }
      --left;
      Eigen::Vector3d corners[3];
      for (unsigned i = 0; i < 3; ++i) {
        if (face.mIndices[i] >= part.mNumVertices) {
          problem = "has a triangle that names a vertex which does not exist";
          return false;
        }
        corners[i] = at(here, part.mVertices[face.mIndices[i]]);
      }
      visit(corners[0], corners[mirrored ? 2 : 1], corners[mirrored ? 1 : 2]);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    if (!for_each_triangle(scene, *node.mChildren[c], here, left, problem, visit)) return false;
  }
  return true;
}

/// Extents of the scene's triangles in the file's units.
std::array<double, 3> extents_of(const aiScene& scene, const Eigen::Matrix3d& to_file) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  std::uint64_t unlimited = UINT64_MAX;
  std::string ignored;  // the second pass meets it again
  for_each_triangle(scene, *scene.mRootNode, {}, unlimited, ignored,
                    [&](const auto&... corner) {
                      ((low = low.cwiseMin(to_file * corner), high = high.cwiseMax(to_file * corner)), ...);
                    });
  const Eigen::Vector3d extent = low.x() <= high.x() ? Eigen::Vector3d(high - low) : Eigen::Vector3d::Zero();
  return {extent.x(), extent.y(), extent.z()};
}

const char* axis_name(UpAxis up) { return up == UpAxis::kX ? "+x" : up == UpAxis::kY ? "+y" : "+z"; }

/// Settles scale and up-axis: the caller's word, else the file's, else a guess with a note.
void settle_frame(const MeshImportOptions& options, const aiScene& scene, const SceneFrame& frame,
                  LoadedMesh& mesh) {
  mesh.format = frame.format;
  if (options.scale) {
    mesh.scale = *options.scale;
  } else if (frame.declared.scale) {
    mesh.scale = *frame.declared.scale;
    mesh.scale_from = KnownFrom::kFile;
  } else {
    const UnitGuess guess = guess_unit(extents_of(scene, frame.to_file));
    mesh.scale = guess.scale;
    mesh.scale_from = KnownFrom::kGuess;
    mesh.notes.push_back("declares no unit: " + guess.why);
  }
  if (options.y_up) {
    mesh.up = *options.y_up ? UpAxis::kY : UpAxis::kZ;
  } else if (frame.declared.up) {
    mesh.up = *frame.declared.up;
    mesh.up_from = KnownFrom::kFile;
  } else {
    mesh.up = guess_up(frame.format);
    mesh.up_from = KnownFrom::kGuess;
    mesh.notes.push_back(std::string("declares no up-axis: ") + axis_name(mesh.up) + " is assumed");
  }
}

const aiScene* read_scene(Assimp::Importer& importer, const std::filesystem::path& path) {
  // Only shape matters here. Normals and the like would also keep equal vertices apart.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS |
                                  aiComponent_MATERIALS);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);  // settle_frame() turns
  return importer.ReadFile(
      path.string(), aiProcess_ValidateDataStructure | aiProcess_RemoveComponent | aiProcess_Triangulate);
}

}  // namespace

bool import_mesh_unguarded(const std::filesystem::path& path, const MeshImportOptions& options,
                           LoadedMesh& mesh, std::string& problem) {
  Assimp::Importer importer;
  const aiScene* scene = read_scene(importer, path);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    problem = std::string("is not a readable mesh: ") + importer.GetErrorString();
    return false;
  }
  const SceneFrame frame = scene_frame(*scene, path);
  settle_frame(options, *scene, frame, mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up) * frame.to_file;
  MeshBuilder builder(mesh);
  std::uint64_t left = options.max_triangles;
  if (!for_each_triangle(*scene, *scene->mRootNode, {}, left, problem,
                         [&](const auto& a, const auto& b, const auto& c) {
                           builder.triangle({builder.vertex(to_metres * a), builder.vertex(to_metres * b),
                                             builder.vertex(to_metres * c)});
                         })) {
    if (left == 0) problem = "has more than " + std::to_string(options.max_triangles) + " triangles";
    return false;
  }
  if (!builder.finite()) {
    problem = "has a coordinate that is not a finite number";
    return false;
  }
  if (mesh.triangles.empty()) {
    problem = "holds no triangles";
    return false;
  }
  if (builder.collapsed() > 0)
    mesh.notes.push_back(std::to_string(builder.collapsed()) + " triangles without extent were left out");
  return true;
}

}  // namespace phantom::geometry::detail
