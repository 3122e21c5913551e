#include "common/geometry/importer/gltf_shape.hpp"

#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

namespace phantom::geometry::detail {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// One node with a mesh of a list (4 triangles), a strip (3), a fan (5), and lines.
json file() {
  return json::parse(R"({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 0}, "mode": 5},
  {"attributes": {"POSITION": 2}, "mode": 6}, {"attributes": {"POSITION": 0}, "mode": 1}, {"attributes": {}}]}],
 "accessors": [{"count": 5, "min": [0, 0, 0], "max": [1, 2, 3]}, {"count": 14}, {"count": 7, "min": [-1, 0, 0], "max": [0, 1, 1]}]})");
}

std::optional<std::uint64_t> triangles(const json& gltf) {
  std::vector<std::string> notes;
  return declared_shape(gltf, notes).triangles;
}

/// A scene of one node with one mesh of `count` triangles between (0,0,0), (1,0,0) and (0,1,0).
std::unique_ptr<aiScene> scene(unsigned count) {
  auto made = std::make_unique<aiScene>();
  auto* mesh = new aiMesh;
  mesh->mNumVertices = 3;
  mesh->mVertices = new aiVector3D[3]{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh->mNumFaces = count;
  mesh->mFaces = new aiFace[count];
  for (unsigned f = 0; f < count; ++f) {
    mesh->mFaces[f].mNumIndices = 3;
    mesh->mFaces[f].mIndices = new unsigned[3]{0, 1, 2};
  }
  made->mNumMeshes = 1;
  made->mMeshes = new aiMesh* [1] { mesh };
  made->mRootNode = new aiNode;
  made->mRootNode->mNumMeshes = 1;
  made->mRootNode->mMeshes = new unsigned[1]{0};
  return made;
}

TEST(GltfShape, CountsListsStripsAndFansOfAllInstances) {
  json gltf = file();
  EXPECT_EQ(triangles(gltf), 12U);
  gltf["nodes"] = json::parse(R"([{"mesh": 0, "children": [1, 2]}, {"mesh": 0}, {"children": []}])");
  EXPECT_EQ(triangles(gltf), 24U);
  gltf["scene"] = 1;
  EXPECT_EQ(triangles(gltf), std::nullopt) << "there is no such scene";
  gltf["scenes"].push_back({{"nodes", {2}}});
  EXPECT_EQ(triangles(gltf), 0U);
}

TEST(GltfShape, SaysNothingOfADamagedFile) {
  const char* kDamaged[] = {R"({"/nodes/0/mesh": 7})",
                            R"({"/nodes/0/children": [0]})",
                            R"({"/nodes/0/children": 3})",
                            R"({"/nodes/0": null})",
                            R"({"/scenes/0/nodes": ["a"]})",
                            R"({"/meshes/0/primitives": {}})",
                            R"({"/meshes/0/primitives/0": 5})",
                            R"({"/meshes/0/primitives/0/attributes": []})",
                            R"({"/meshes/0/primitives/0/indices": 9})",
                            R"({"/accessors/1/count": -4})",
                            R"({"/accessors/1/count": 1e300})",
                            R"({"/accessors/1/count": 99999999999})"};
  for (const char* damage : kDamaged) {
    json gltf = file();
    const json change = json::parse(damage);
    for (const auto& [place, value] : change.items()) gltf[json::json_pointer(place)] = value;
    EXPECT_EQ(triangles(gltf), std::nullopt) << damage;
  }
  EXPECT_EQ(triangles(json::object()), std::nullopt);
}

TEST(GltfShape, SR27_AnotherNumberOfTrianglesIsAnotherShape) {
  std::vector<std::string> notes;
  GltfShape declared{.triangles = 2};
  EXPECT_EQ(compare_with(declared, *scene(2), notes), "");
  EXPECT_THAT(compare_with(declared, *scene(1), notes),
              HasSubstr("declares 2 triangles, of which 1 were read"));
  EXPECT_EQ(compare_with({}, *scene(1), notes), "") << "nothing is declared";
  EXPECT_THAT(notes, IsEmpty());
}

TEST(GltfShape, CornersBeyondTheDeclaredBoundsAreNoted) {
  std::vector<std::string> notes;
  GltfShape declared{.triangles = 1, .low = {0, 0, 0}, .high = {1, 0.995, 0}, .bounded = true};
  EXPECT_EQ(compare_with(declared, *scene(1), notes), "");
  EXPECT_THAT(notes, IsEmpty()) << "rounded within 1 %";
  declared.high[1] = 0.9;
  EXPECT_EQ(compare_with(declared, *scene(1), notes), "");
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes[0], HasSubstr("corners that lie 0.1"));
}

TEST(GltfShape, BoundsAreThoseOfAllCorners) {
  std::vector<std::string> notes;
  json gltf = file();
  const GltfShape shape = declared_shape(gltf, notes);
  EXPECT_TRUE(shape.bounded);
  EXPECT_EQ(std::vector<double>(shape.low, shape.low + 3), (std::vector<double>{-1, 0, 0}));
  EXPECT_EQ(std::vector<double>(shape.high, shape.high + 3), (std::vector<double>{1, 2, 3}));
  gltf["accessors"][2].erase("min");
  EXPECT_FALSE(declared_shape(gltf, notes).bounded);
}

}  // namespace
}  // namespace phantom::geometry::detail
