#include "common/geometry/mesh/mesh_import.hpp"

#include <fstream>

#include "common/core/text.hpp"
#include "common/geometry/mesh/stl_text.hpp"

namespace phantom::geometry::detail {
namespace {

constexpr const char* kNoUnit = "declares no unit: ";

const char* axis_name(UpAxis up) { return up == UpAxis::kX ? "+x" : up == UpAxis::kY ? "+y" : "+z"; }

std::array<double, 3> extents_of(const BoundingBox& box) {
  if (box.empty()) return {};
  const Eigen::Vector3f extent = box.max_m - box.min_m;
  return {extent.x(), extent.y(), extent.z()};
}

}  // namespace

std::string extension_of(const std::filesystem::path& path) {
  const std::string extension = core::lower_case(path.extension().string());
  return extension.empty() ? extension : extension.substr(1);
}

Eigen::Matrix3d to_z_up(UpAxis up) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (up == UpAxis::kY) turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == UpAxis::kX) turn << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  return turn;
}

void resolve_frame(const MeshImportOptions& options, std::string_view format, const DeclaredFrame& declared,
                   const std::function<std::array<double, 3>()>& extents, LoadedMesh& mesh) {
  mesh.format = format;
  if (options.scale) {
    mesh.scale = *options.scale;
  } else if (declared.scale) {
    mesh.scale = *declared.scale;
    mesh.scale_from = KnownFrom::kFile;
  } else {
    const UnitGuess guess = guess_unit(extents());
    mesh.scale = guess.scale;
    mesh.scale_from = KnownFrom::kGuess;
    mesh.notes.push_back(kNoUnit + guess.why);
  }
  if (options.y_up) {
    mesh.up = *options.y_up ? UpAxis::kY : UpAxis::kZ;
  } else if (declared.up) {
    mesh.up = *declared.up;
    mesh.up_from = KnownFrom::kFile;
  } else {
    mesh.up = guess_up(format);
    mesh.up_from = KnownFrom::kGuess;
    mesh.notes.push_back(std::string("declares no up-axis: ") + axis_name(mesh.up) + " is assumed");
  }
}

bool finish_import(bool finite, std::size_t collapsed, LoadedMesh& mesh, std::string& problem) {
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

std::string too_many_triangles(const MeshImportOptions& options) {
  return "has more than " + std::to_string(options.max_triangles) + " triangles";
}

bool finish_stl(StlMesh stl, const MeshImportOptions& options, LoadedMesh& mesh, std::string& problem) {
  resolve_frame(
      options, "Stereolithography (STL) Importer", {}, [&] { return extents_of(stl.bounding_box()); }, mesh);
  const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up);
  for (Eigen::Vector3f& v : stl.vertices_m) v = (to_metres * v.cast<double>()).cast<float>();
  static_cast<TriangleMesh&>(mesh) = std::move(stl);
  return finish_import(mesh.all_finite(), stl.collapsed, mesh, problem);
}

std::optional<bool> import_binary_stl(const std::filesystem::path& path, const MeshImportOptions& options,
                                      std::uint64_t most_triangles, LoadedMesh& mesh, std::string& problem) {
  if (extension_of(path) != "stl") return std::nullopt;
  std::vector<std::uint8_t> bytes(kStlLookBytes);
  std::ifstream file(path, std::ios::binary);
  const auto read_from = [&](std::size_t at) {
    file.read(reinterpret_cast<char*>(bytes.data() + at), static_cast<std::streamsize>(bytes.size() - at));
    return static_cast<std::size_t>(file.gcount()) == bytes.size() - at;
  };
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  if (none) return std::nullopt;
  bytes.resize(std::min<std::uint64_t>(size, kStlLookBytes));
  if (!read_from(0)) return std::nullopt;
  auto triangles = binary_stl_triangles(bytes, size);
  if (!triangles && !looks_like_text_stl(bytes)) triangles = binary_stl_triangles_within(bytes, size);
  if (!triangles || *triangles > most_triangles) return std::nullopt;
  if (*triangles > options.max_triangles) {
    problem = too_many_triangles(options);
    return false;
  }
  const std::uint64_t used = binary_stl_bytes(*triangles);
  const std::size_t before = std::min<std::size_t>(bytes.size(), used);
  bytes.resize(used);
  if (!read_from(before)) return std::nullopt;
  if (used < size) {
    mesh.notes.push_back("has " + std::to_string(size - used) + " bytes after the " +
                         std::to_string(*triangles) +
                         " triangles that its head declares: they are passed over");
  }
  return finish_stl(read_binary_stl(bytes), options, mesh, problem);
}

}  // namespace phantom::geometry::detail

namespace phantom::geometry {

void replace_guessed_unit(LoadedMesh& mesh, double scale, const std::string& why) {
  for (Eigen::Vector3f& v : mesh.vertices_m) v = (scale / mesh.scale * v.cast<double>()).cast<float>();
  mesh.scale = scale;
  std::erase_if(mesh.notes, [](const std::string& note) { return note.starts_with(detail::kNoUnit); });
  mesh.notes.push_back(detail::kNoUnit + why);
}

}  // namespace phantom::geometry
