#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <string_view>

#include "common/geometry/importer/importer.hpp"
#include "common/geometry/importer/polygons.hpp"
#include "common/geometry/importer/three_mf.hpp"
#include "common/geometry/mesh/mesh_import.hpp"
#include "common/geometry/mesh/stl_text.hpp"
#include "common/geometry/mesh/vertex_welder.hpp"

namespace phantom::geometry::detail {
namespace {

using Affine = aiMatrix4x4t<double>;

Eigen::Vector3d at(const Affine& to_scene, const aiVector3D& p) {
  const aiVector3t<double> q = to_scene * aiVector3t<double>(p.x, p.y, p.z);
  return {q.x, q.y, q.z};
}

/// Calls visit(corner, corner, corner) for every triangle of the node and its children, in the scene's
/// coordinates. Outward stays outward, also for mirrored nodes. Returns false, with the reason, if the scene
/// is damaged or too large.
template <class Visit>
bool for_each_triangle(const aiScene& scene, const aiNode& node, const Affine& to_root, std::uint64_t& left,
                       std::string& problem, const Visit& visit) {
  const Affine here = to_root * Affine(node.mTransformation);
  const bool mirrored = aiMatrix3x3t<double>(here).Determinant() < 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    if (node.mMeshes[m] >= scene.mNumMeshes) {
      problem = "has a node that names a mesh which does not exist";
      return false;
    }
    const aiMesh& part = *scene.mMeshes[node.mMeshes[m]];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // skips points and lines
      if (left == 0) {
        problem = "has more triangles than the limit";
        return false;
      }
      --left;
      Eigen::Vector3d corners[3];
      for (unsigned i = 0; i < 3; ++i) corners[i] = at(here, part.mVertices[face.mIndices[i]]);
      visit(corners[0], corners[mirrored ? 2 : 1], corners[mirrored ? 1 : 2]);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    if (node.mChildren[c] == nullptr) continue;  // some importers leave null pointers
    if (!for_each_triangle(scene, *node.mChildren[c], here, left, problem, visit)) return false;
  }
  return true;
}

/// Returns the extents of the scene's triangles in the file's units.
std::array<double, 3> scene_extents(const aiScene& scene, const Eigen::Matrix3d& to_file) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  std::uint64_t unlimited = UINT64_MAX;
  std::string ignored;  // the second pass reports it again
  for_each_triangle(scene, *scene.mRootNode, {}, unlimited, ignored, [&](const auto&... corner) {
    ((low = low.cwiseMin(to_file * corner), high = high.cwiseMax(to_file * corner)), ...);
  });
  const Eigen::Vector3d extent = low.x() <= high.x() ? Eigen::Vector3d(high - low) : Eigen::Vector3d::Zero();
  return {extent.x(), extent.y(), extent.z()};
}

bool import_by_assimp(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                      std::string& problem) {
  Assimp::Importer importer;
  const aiScene* scene = read_scene(importer, path, options.max_memory_bytes, mesh.notes, problem);
  if (scene == nullptr) return false;
  const SceneFrame frame = scene_frame(*scene, path);
  resolve_frame(
      options, frame.format, frame.declared, [&] { return scene_extents(*scene, frame.to_file); }, mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up) * frame.to_file;
  VertexWelder corners(mesh);
  std::uint64_t left = options.max_triangles;
  const auto vertex = [&](const Eigen::Vector3d& p) { return corners.vertex((to_metres * p).cast<float>()); };
  if (!for_each_triangle(*scene, *scene->mRootNode, {}, left, problem,
                         [&](const auto& a, const auto& b, const auto& c) {
                           corners.triangle({vertex(a), vertex(b), vertex(c)});
                         })) {
    if (left == 0) problem = too_many_triangles(options);
    return false;
  }
  return finish_import(corners.finite(), corners.collapsed(), mesh, problem);
}

/// Explains why a file with the extension of an STL is neither kind of STL.
std::string no_stl(std::string_view bytes) {
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
    return "is a text of 16 bits a character (UTF-16), which is not read: save it as plain text";
  if (bytes.size() < kStlHeadBytes) return "is not a readable mesh: neither a text nor a binary STL";
  const auto printable = [](char c) {
    return (c >= ' ' && c != '\x7f') || (c >= '\t' && c <= '\r') || c < 0;
  };
  if (std::ranges::all_of(bytes.substr(0, std::min<std::size_t>(bytes.size(), kStlLookBytes)), printable)) {
    const std::string_view line = bytes.substr(0, bytes.find_first_of("\r\n"));
    return "is a text that does not begin with 'solid', as a text STL does, but with '" +
           std::string(line.substr(0, 40)) + "'";
  }
  std::uint32_t triangles = 0;
  for (std::size_t i = 4; i-- > 0;) triangles = triangles << 8 | static_cast<std::uint8_t>(bytes[80 + i]);
  const std::string neither = "is not a readable mesh: neither a text STL, nor a binary one, ";
  if (triangles == 0) return neither + "of which the head declares 0 triangles";
  return neither + "which would be " + std::to_string(binary_stl_bytes(triangles)) + " bytes long for the " +
         std::to_string(triangles) + " triangles that stand in its head; it has " +
         std::to_string(bytes.size()) + ". Was it cut short?";
}

bool import_stl_text(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                     std::string& problem) {
  std::error_code none;
  std::string text(std::filesystem::file_size(path, none), '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (!looks_like_text_stl({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()})) {
    problem = no_stl(text);
    return false;
  }
  TextStl stl = read_text_stl(text, options.max_triangles);
  if (stl.too_many) problem = too_many_triangles(options);
  if (!stl.problem.empty()) problem = "is not a readable text STL: " + stl.problem;
  if (stl.too_many || !stl.problem.empty()) return false;
  mesh.notes = std::move(stl.notes);
  return finish_stl(std::move(stl.mesh), options, mesh, problem);
}

}  // namespace

bool import_mesh(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                 std::string& problem) {
  if (extension_of(path) == "3mf") return import_3mf(path, options, mesh, problem);
  if (extension_of(path) == "ply" || extension_of(path) == "obj")
    return import_polygons(path, options, mesh, problem);
  if (extension_of(path) != "stl") return import_by_assimp(path, options, mesh, problem);
  if (const auto read = import_binary_stl(path, options, UINT32_MAX, mesh, problem)) return *read;
  return import_stl_text(path, options, mesh, problem);
}

}  // namespace phantom::geometry::detail
