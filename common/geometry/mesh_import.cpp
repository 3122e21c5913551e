#include "common/geometry/mesh_import.hpp"

#include <assimp/scene.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <fstream>

#include "common/geometry/assimp_scene.hpp"
#include "common/geometry/joined_corners.hpp"
#include "common/geometry/mesh_frame.hpp"
#include "common/geometry/stl.hpp"

namespace phantom::geometry::detail {
namespace {

using Affine = aiMatrix4x4t<double>;

Eigen::Vector3d at(const Affine& to_scene, const aiVector3D& p) {
  const aiVector3t<double> q = to_scene * aiVector3t<double>(p.x, p.y, p.z);
  return {q.x, q.y, q.z};
}

/// Calls visit(corner, corner, corner) with every triangle of the node and its children, in the scene's
/// coordinates and outward where the mesh itself is; false and why if the scene is damaged or too large.
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
      if (face.mNumIndices != 3) continue;  // points and lines
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
    if (node.mChildren[c] == nullptr) continue;  // some importers leave gaps
    if (!for_each_triangle(scene, *node.mChildren[c], here, left, problem, visit)) return false;
  }
  return true;
}

/// Extents of the scene's triangles in the file's units.
std::array<double, 3> extents_of(const aiScene& scene, const Eigen::Matrix3d& to_file) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  std::uint64_t unlimited = UINT64_MAX;
  std::string ignored;  // the second pass meets it again
  for_each_triangle(scene, *scene.mRootNode, {}, unlimited, ignored, [&](const auto&... corner) {
    ((low = low.cwiseMin(to_file * corner), high = high.cwiseMax(to_file * corner)), ...);
  });
  const Eigen::Vector3d extent = low.x() <= high.x() ? Eigen::Vector3d(high - low) : Eigen::Vector3d::Zero();
  return {extent.x(), extent.y(), extent.z()};
}

const char* axis_name(UpAxis up) { return up == UpAxis::kX ? "+x" : up == UpAxis::kY ? "+y" : "+z"; }

/// Settles scale and up-axis: the caller's word, else the file's, else a guess with a note. `extents`: gives
/// those of the mesh in the file's units.
template <class Extents>
void settle_frame(const MeshImportOptions& options, const SceneFrame& frame, const Extents& extents,
                  LoadedMesh& mesh) {
  mesh.format = frame.format;
  if (options.scale) {
    mesh.scale = *options.scale;
  } else if (frame.declared.scale) {
    mesh.scale = *frame.declared.scale;
    mesh.scale_from = KnownFrom::kFile;
  } else {
    const UnitGuess guess = guess_unit(extents());
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

/// What is said of every outcome; false and why if there is none.
bool settle(bool finite, std::size_t collapsed, LoadedMesh& mesh, std::string& problem) {
  if (!finite) {
    problem = "has a coordinate that is not a finite number";
    return false;
  }
  if (mesh.triangles.empty()) {
    problem = "holds no triangles";
    if (collapsed > 0) problem += " but " + std::to_string(collapsed) + " without extent";
    return false;
  }
  if (collapsed > 0)
    mesh.notes.push_back(std::to_string(collapsed) + " triangles without extent were left out");
  return true;
}

std::string too_many(const MeshImportOptions& options) {
  return "has more than " + std::to_string(options.max_triangles) + " triangles";
}

bool is_stl(const std::filesystem::path& path) { return ending_of(path) == "stl"; }

/// The file, if it is a binary STL; empty if it is not, or has too many triangles.
std::vector<std::uint8_t> binary_stl_in(const std::filesystem::path& path, const MeshImportOptions& options,
                                        std::string& problem) {
  std::vector<std::uint8_t> bytes(kStlHeadBytes);
  std::ifstream file(path, std::ios::binary);
  const auto read = [&](std::size_t from) {
    file.read(reinterpret_cast<char*>(bytes.data() + from),
              static_cast<std::streamsize>(bytes.size() - from));
    return static_cast<bool>(file);
  };
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  const auto triangles = !none && read(0) ? binary_stl_triangles(bytes, size) : std::nullopt;
  if (!triangles) return {};
  if (*triangles > options.max_triangles) {
    problem = too_many(options);
    return {};
  }
  bytes.resize(size);
  if (!read(kStlHeadBytes)) return {};
  return bytes;
}

/// Binary STLs, by far the most of a workshop's files, are read here: assimp takes several times as long for
/// them.
bool import_binary_stl(const std::vector<std::uint8_t>& bytes, const MeshImportOptions& options,
                       LoadedMesh& mesh, std::string& problem) {
  StlMesh stl = read_binary_stl(bytes);
  SceneFrame frame;
  frame.format = "Stereolithography (STL) Importer";
  settle_frame(
      options, frame,
      [&] {
        const BoundingBox box = stl.bounding_box();
        const Eigen::Vector3d extent =
            box.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d((box.max_m - box.min_m).cast<double>());
        return std::array{extent.x(), extent.y(), extent.z()};
      },
      mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up);
  for (Eigen::Vector3f& v : stl.vertices_m) v = (to_metres * v.cast<double>()).cast<float>();
  static_cast<TriangleMesh&>(mesh) = std::move(stl);
  return settle(mesh.all_finite(), stl.collapsed, mesh, problem);
}

bool import_by_assimp(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                      std::string& problem) {
  Assimp::Importer importer;
  const aiScene* scene = read_scene(importer, path, options.max_memory_bytes, mesh.notes, problem);
  if (scene == nullptr) return false;
  const SceneFrame frame = scene_frame(*scene, path);
  settle_frame(
      options, frame, [&] { return extents_of(*scene, frame.to_file); }, mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up) * frame.to_file;
  JoinedCorners corners(mesh);
  std::uint64_t left = options.max_triangles;
  const auto vertex = [&](const Eigen::Vector3d& p) { return corners.vertex((to_metres * p).cast<float>()); };
  if (!for_each_triangle(*scene, *scene->mRootNode, {}, left, problem,
                         [&](const auto& a, const auto& b, const auto& c) {
                           corners.triangle({vertex(a), vertex(b), vertex(c)});
                         })) {
    if (left == 0) problem = too_many(options);
    return false;
  }
  return settle(corners.finite(), corners.collapsed(), mesh, problem);
}

/// Whether a text STL has its last line; assimp takes what stands before where it was cut short.
bool has_end(const std::filesystem::path& path) {
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  const auto last = static_cast<std::size_t>(std::min<std::uint64_t>(none ? 0 : size, 4096));
  std::string text(last, '\0');
  std::ifstream file(path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(last), std::ios::end);
  file.read(text.data(), static_cast<std::streamsize>(last));
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text.find("endsolid") != std::string::npos;
}

/// Why a file with an STL's ending is neither kind of STL; the importer does not say.
std::string no_stl(const std::filesystem::path& path) {
  std::array<std::uint8_t, kStlHeadBytes> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(head.data()), kStlHeadBytes))
    return "is not a readable mesh: neither a text nor a binary STL";
  std::uint64_t triangles = 0;
  for (std::size_t i = 4; i-- > 0;) triangles = triangles << 8 | head[80 + i];
  std::error_code none;
  return "is not a readable mesh: neither a text STL, nor a binary one, which would be " +
         std::to_string(kStlHeadBytes + 50 * triangles) + " bytes long for the " + std::to_string(triangles) +
         " triangles that stand in its head; it has " +
         std::to_string(std::filesystem::file_size(path, none)) + ". Was it cut short?";
}

bool import_stl_text(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                     std::string& problem) {
  const bool read = import_by_assimp(path, options, mesh, problem);
  if (!read && problem.find("STL storage representation") != std::string::npos) problem = no_stl(path);
  if (read && !has_end(path)) mesh.notes.emplace_back("has no 'endsolid' at its end: was it cut short?");
  return read;
}

}  // namespace

std::optional<bool> import_small_binary_stl(const std::filesystem::path& path,
                                            const MeshImportOptions& options, LoadedMesh& mesh,
                                            std::string& problem) {
  constexpr std::uint64_t kMost = 1'000'000, kBytesEach = 256;  // triangles; memory for each while it is read
  MeshImportOptions small = options;
  small.max_triangles = static_cast<std::uint32_t>(
      std::min({std::uint64_t{options.max_triangles}, kMost, options.max_memory_bytes / kBytesEach}));
  std::string larger;
  const auto bytes = is_stl(path) ? binary_stl_in(path, small, larger) : std::vector<std::uint8_t>{};
  if (bytes.empty()) return std::nullopt;
  return import_binary_stl(bytes, options, mesh, problem);
}

bool import_mesh_unguarded(const std::filesystem::path& path, const MeshImportOptions& options,
                           LoadedMesh& mesh, std::string& problem) {
  if (!is_stl(path)) return import_by_assimp(path, options, mesh, problem);
  const std::vector<std::uint8_t> stl = binary_stl_in(path, options, problem);
  if (!problem.empty()) return false;
  return stl.empty() ? import_stl_text(path, options, mesh, problem)
                     : import_binary_stl(stl, options, mesh, problem);
}

}  // namespace phantom::geometry::detail
