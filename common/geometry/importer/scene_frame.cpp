#include <assimp/commonMetaData.h>
#include <assimp/scene.h>
#include <unzip.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>

#include "common/geometry/importer/importer.hpp"
#include "common/geometry/mesh/mesh_import.hpp"

namespace phantom::geometry::detail {
namespace {

constexpr std::size_t kHeadBytes = 1 << 18;  // far more than what precedes the geometry

std::string head_of_file(const std::filesystem::path& path) {
  std::string head(kHeadBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

/// Returns the first bytes of the archive's first member whose name passes; empty if there is none.
template <class Passes>
std::string head_of_member(const std::filesystem::path& path, const Passes& passes) {
  const std::unique_ptr<void, int (*)(void*)> archive(unzOpen(path.c_str()), unzClose);
  if (!archive || unzGoToFirstFile(archive.get()) != UNZ_OK) return {};
  do {
    char name[512] = {};
    unz_file_info info{};  // minizip 1.1 writes to it even if not requested
    if (unzGetCurrentFileInfo(archive.get(), &info, name, sizeof name - 1, nullptr, 0, nullptr, 0) !=
            UNZ_OK ||
        !passes(std::string_view(name))) {
      continue;
    }
    if (unzOpenCurrentFile(archive.get()) != UNZ_OK) return {};
    std::string head(kHeadBytes, '\0');
    const int count = unzReadCurrentFile(archive.get(), head.data(), static_cast<unsigned>(head.size()));
    unzCloseCurrentFile(archive.get());
    head.resize(count < 0 ? 0 : static_cast<std::size_t>(count));
    return head;
  } while (unzGoToNextFile(archive.get()) == UNZ_OK);
  return {};
}

std::string head_of_first(const std::filesystem::path& path, std::string_view ending) {
  return head_of_member(path, [&](std::string_view name) { return name.ends_with(ending); });
}

/// Returns the head of a text format, from within its archive if it is in one.
std::string head_of(const std::filesystem::path& path, std::string_view format) {
  std::string head = head_of_file(path);
  if (!head.starts_with("PK")) return head;
  return head_of_first(path, format.starts_with("Collada") ? ".dae" : "");
}

DeclaredFrame fbx(const aiScene& scene) {
  DeclaredFrame frame;
  if (scene.mMetaData == nullptr) return frame;
  float centimetres = 0.0F;
  std::int32_t axis = -1, sign = 1;
  if (scene.mMetaData->Get("UnitScaleFactor", centimetres) && std::isfinite(centimetres) && centimetres > 0)
    frame.scale = std::round(static_cast<double>(centimetres) * 1e7) * 1e-9;  // a float: 2.54 → 0.0254
  scene.mMetaData->Get("UpAxisSign", sign);
  // A downward axis is left to the caller: no known tool writes it.
  if (scene.mMetaData->Get("UpAxis", axis) && axis >= 0 && axis < 3 && sign > 0)
    frame.up = static_cast<UpAxis>(axis);
  return frame;
}

/// Returns the scale of the importer's root node, which alone contains the unit.
double unit_in_root(const aiScene& scene, const DeclaredFrame& declared) {
  const aiMatrix4x4& root = scene.mRootNode->mTransformation;
  const double length =
      std::hypot(static_cast<double>(root.a1), static_cast<double>(root.b1), static_cast<double>(root.c1));
  return declared.scale.value_or(length > 0 ? length : 1.0);
}

}  // namespace

SceneFrame scene_frame(const aiScene& scene, const std::filesystem::path& path) {
  SceneFrame frame;
  aiString name;
  if (scene.mMetaData != nullptr && scene.mMetaData->Get(AI_METADATA_SOURCE_FORMAT, name))
    frame.format = name.C_Str();
  const std::string_view format = frame.format;
  const auto is = [&](std::string_view start) { return format.starts_with(start); };
  if (is("glTF") || is("Extensible 3D")) {
    frame.declared = {1.0, UpAxis::kY};  // as defined by their standards
  } else if (is("Autodesk FBX")) {
    frame.declared = fbx(scene);
  } else if (is("Industry Foundation Classes")) {
    // The importer converts the file's unit into metres, and +z up into +y up.
    frame.declared = {1.0, UpAxis::kZ};
    frame.to_file = to_z_up(UpAxis::kY);
  } else if (is("Discreet 3DS") || is("ASE")) {
    frame.declared.up = UpAxis::kZ;  // as in 3ds Max; the importer turns it into +y up
    frame.to_file = to_z_up(UpAxis::kY);
  } else {
    frame.declared = declared_in_text(format, head_of(path, format));
    if (is("Collada")) frame.to_file /= unit_in_root(scene, frame.declared);
  }
  return frame;
}

}  // namespace phantom::geometry::detail
