#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "common/geometry/mesh/mesh_io.hpp"

// Every model of the importer's own collection (Debian: assimp-testmodels): a mesh or a clear reason.

namespace phantom::geometry {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kModels = "/usr/share/assimp/models";

class ModelFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(kModels))
      GTEST_SKIP() << "the package assimp-testmodels is not installed";
  }
};

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

core::Expected<LoadedMesh> load(const std::filesystem::path& path) {
  return load_mesh(path, {.max_cpu_s = 20, .max_memory_bytes = 2ULL << 30});
}

TEST_F(ModelFiles, EachGivesAMeshOrAReason) {
  // Formats of which the collection has at least one model with triangles. Not among them: motions (bvh,
  // csm), animations of other files (md5anim, lws), pictures, formats that Debian's build leaves out (m3d),
  // and those whose models the importer itself refuses as damaged (irr, irrmesh, ter).
  const std::set<std::string> with_geometry = {
      ".stl", ".obj",  ".ply", ".off",   ".gltf", ".glb",     ".dae", ".zae", ".x",   ".3mf", ".3ds",
      ".amf", ".ac",   ".ase", ".blend", ".fbx",  ".dxf",     ".ifc", ".lwo", ".md2", ".mdl", ".ms3d",
      ".nff", ".q3o",  ".raw", ".smd",   ".x3d",  ".b3d",     ".cob", ".iqm", ".lxo", ".sib", ".xgl",
      ".zgl", ".ogex", ".acc", ".hmp",   ".3d",   ".md5mesh", ".mdc", ".xml"};
  std::map<std::string, int> loaded;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kModels)) {
    if (!entry.is_regular_file()) continue;
    const auto mesh = load(entry.path());
    if (!mesh) {
      EXPECT_THAT(mesh.status().message(), HasSubstr(entry.path().string() + ": "));
      EXPECT_NE(mesh.status().code(), core::ErrorCode::kInternal) << mesh.status().message();
      continue;
    }
    ++loaded[ending_of(entry.path())];
    EXPECT_TRUE(mesh->all_finite()) << entry.path();
    EXPECT_GT(mesh->scale, 0) << entry.path();
    EXPECT_FALSE(mesh->format.empty()) << entry.path();
    const bool guessed = mesh->scale_from == KnownFrom::kGuess || mesh->up_from == KnownFrom::kGuess;
    EXPECT_FALSE(guessed && mesh->notes.empty()) << entry.path();
  }
  for (const std::string& ending : with_geometry) EXPECT_GT(loaded[ending], 0) << ending;
}

/// The same shape in several formats: a box of 10 × 20 × 30 mm, a duck.
TEST_F(ModelFiles, DeclaredUnitsAreApplied) {
  const auto box = load(kModels / "3MF/box.3mf");
  ASSERT_TRUE(box) << box.status().message();
  EXPECT_EQ(box->scale, 0.001);
  EXPECT_EQ(box->scale_from, KnownFrom::kFile);
  const auto extent = [](const TriangleMesh& mesh) -> Eigen::Vector3f {
    return mesh.bounding_box().max_m - mesh.bounding_box().min_m;
  };
  EXPECT_TRUE(extent(*box).isApprox(Eigen::Vector3f(0.01F, 0.02F, 0.03F)));

  const auto duck = load(kModels / "Collada/duck.dae"), zipped = load(kModels / "Collada/duck.zae");
  ASSERT_TRUE(duck && zipped);
  EXPECT_EQ(duck->scale, 0.01);
  EXPECT_TRUE(extent(*duck).isApprox(Eigen::Vector3f(1.655F, 1.153F, 1.54F), 1e-3F));  // +y up in the file
  EXPECT_EQ(duck->up, UpAxis::kY);
  EXPECT_EQ(zipped->scale_from, KnownFrom::kFile);
  EXPECT_TRUE(extent(*zipped).isApprox(extent(*duck), 1e-3F));

  const auto gltf = load(kModels / "glTF2/BoxTextured-glTF/BoxTextured.gltf");
  ASSERT_TRUE(gltf) << gltf.status().message();
  EXPECT_EQ(gltf->scale_from, KnownFrom::kFile);
  EXPECT_EQ(gltf->up, UpAxis::kY);

  const auto fbx = load(kModels / "FBX/global_settings.fbx");  // UnitScaleFactor 500
  ASSERT_TRUE(fbx) << fbx.status().message();
  EXPECT_EQ(fbx->scale, 5.0);
  EXPECT_EQ(fbx->scale_from, KnownFrom::kFile);

  const auto max = load(kModels / "3DS/CameraRollAnim.3ds");
  ASSERT_TRUE(max) << max.status().message();
  EXPECT_EQ(max->up, UpAxis::kZ);
  EXPECT_EQ(max->up_from, KnownFrom::kFile);

  const auto house = load(kModels / "IFC/AC14-FZK-Haus.ifc");
  ASSERT_TRUE(house) << house.status().message();
  EXPECT_NEAR(extent(*house).z(), 7.318F, 0.01F);  // upright
}

}  // namespace
}  // namespace phantom::geometry
