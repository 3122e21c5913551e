#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/DefaultLogger.hpp>
#include <assimp/Importer.hpp>
#include <assimp/Logger.hpp>
#include <fstream>
#include <memory>
#include <string_view>
#include <utility>

#include "common/geometry/importer/gltf_shape.hpp"
#include "common/geometry/importer/importer.hpp"
#include "common/geometry/mesh/mesh_import.hpp"

namespace phantom::geometry::detail {
namespace {

bool is_sound(const aiMesh& mesh) {
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices > 0 && face.mIndices == nullptr) return false;
    for (unsigned i = 0; i < face.mNumIndices; ++i) {
      if (face.mIndices[i] >= mesh.mNumVertices) return false;
    }
  }
  return mesh.mNumVertices == 0 || mesh.mVertices != nullptr;
}

bool is_sound(const aiScene& scene) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    if (scene.mMeshes[m] == nullptr || !is_sound(*scene.mMeshes[m])) return false;
  }
  return true;
}

/// Collects the errors that assimp logs although it continues: parts of the shape that it left out or
/// invented.
class ErrorLog : public Assimp::Logger {
 public:
  explicit ErrorLog(std::vector<std::string>& notes) : notes_(notes) {}
  bool attachStream(Assimp::LogStream*, unsigned) override { return false; }
  bool detachStream(Assimp::LogStream*, unsigned) override { return false; }

 private:
  static constexpr std::size_t kMax = 5;  // enough: a damaged file repeats its errors

  void OnDebug(const char*) override {}
  void OnVerboseDebug(const char*) override {}
  void OnInfo(const char*) override {}
  void OnWarn(const char*) override {}
  void OnError(const char* message) override {
    std::string note = std::string("its importer says: ") + message;
    std::replace(note.begin(), note.end(), '\n', ' ');
    constexpr std::string_view kLooksOrMotion[] = {"material", "texture",   "tangent",
                                                   "binormal", "Bone",      "light",
                                                   "camera",   "animation", "unsupported chunk"};
    if (notes_.size() >= kMax || std::find(notes_.begin(), notes_.end(), note) != notes_.end() ||
        std::any_of(std::begin(kLooksOrMotion), std::end(kLooksOrMotion),
                    [&](std::string_view word) { return note.find(word) != std::string::npos; }))
      return;
    notes_.push_back(std::move(note));
  }

  std::vector<std::string>& notes_;
};

/// Returns a message about a failed import that tells the user what to do.
std::string refusal(const Assimp::Importer& importer, const std::filesystem::path& path,
                    std::uint64_t max_memory_bytes) {
  const std::string extension = extension_of(path), reason = importer.GetErrorString();
  if (extension.empty() || !importer.IsExtensionSupported("." + extension)) {
    return "is in no format that is read (by its ending '" + extension +
           "'); allowed: STL, OBJ, PLY, OFF, glTF, COLLADA, 3MF, X, X3D, AMF, FBX and what else assimp reads";
  }
  if (reason.find("bad_alloc") != std::string::npos)
    return "needs more memory than the " + std::to_string(max_memory_bytes >> 20) + " MiB allowed";
  if (reason.find("No suitable reader") != std::string::npos)
    return "holds something else than its ending '" + extension +
           "' says, or a version of it that is not read";
  return "is not a readable mesh" + (reason.empty() ? ", the importer does not say why" : ": " + reason);
}

/// Returns whether the file is a STEP file (ISO 10303-21) of another schema than IFC: surfaces of a CAD
/// program.
bool is_cad_step(const std::filesystem::path& path) {
  std::string head(1 << 16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  const std::size_t start = head.find("ISO-10303-21");
  if (start == std::string::npos || head.find_first_not_of(" \t\r\n\xef\xbb\xbf") != start) return false;
  const std::size_t schema = head.find("FILE_SCHEMA");
  return schema == std::string::npos || head.substr(schema, 80).find("IFC") == std::string::npos;
}

/// Opens files under the name that a URI in a model stands for, too: "part%20one.bin" is "part one.bin".
class UriFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* name) const override {
    return Assimp::DefaultIOSystem::Exists(name) ||
           Assimp::DefaultIOSystem::Exists(decoded_uri(name).c_str());
  }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    const bool as_it_is = Assimp::DefaultIOSystem::Exists(name);
    return Assimp::DefaultIOSystem::Open(as_it_is ? name : decoded_uri(name).c_str(), mode);
  }
};

}  // namespace

const aiScene* read_scene(Assimp::Importer& importer, const std::filesystem::path& path,
                          std::uint64_t max_memory_bytes, std::vector<std::string>& notes,
                          std::string& problem) {
  GltfShape declared;
  if (problem = check_gltf(path, notes, declared); !problem.empty()) return nullptr;
  if (problem = check_lossy_format(path); !problem.empty()) return nullptr;
  const std::string ending = extension_of(path);
  const bool iges = ending == "igs" || ending == "iges";
  if (iges || is_cad_step(path)) {
    problem =
        std::string("is ") + (iges ? "an IGES" : "a STEP") +
        " file of a CAD program, of surfaces, which is not read: export it as a mesh (STL, 3MF, glTF …)";
    return nullptr;
  }
  importer.SetIOHandler(new UriFiles);  // the importer owns it
  // Replaces assimp's logger in the whole process; null restores and deletes.
  Assimp::DefaultLogger::set(new ErrorLog(notes));
  const std::unique_ptr<void, void (*)(void*)> until_return(
      &importer, [](void*) { Assimp::DefaultLogger::set(nullptr); });
  // Only the shape is needed. Normals and the like would also keep equal vertices apart.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS |
                                  aiComponent_MATERIALS);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);  // the caller rotates
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);  // invented where there is no shape
  // aiProcess_ValidateDataStructure is not used: it also refuses a light without a node, an empty part, or
  // points beside triangles. The used parts of the scene are checked below, before polygons are triangulated.
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_RemoveComponent);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    problem = refusal(importer, path, max_memory_bytes);
    return nullptr;
  }
  if (!is_sound(*scene)) {
    problem = "has a face that names a vertex which does not exist";
    return nullptr;
  }
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr) problem = refusal(importer, path, max_memory_bytes);
  if (scene == nullptr || !(problem = compare_with(declared, *scene, notes)).empty()) return nullptr;
  return scene;
}

}  // namespace phantom::geometry::detail
