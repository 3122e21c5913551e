#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "common/geometry/tests/mesh_files.hpp"

// What a file says beside its shape must neither spoil the shape nor be mistaken for it.

namespace phantom::geometry {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Scenes : public MeshFiles {};

/// A triangle (0,0,0) (1,0,0) (0,1,0); `more`: further keys of the file.
std::string gltf(const std::string& more) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}])" +
         more + "}";
}

TEST_F(Scenes, AnEmptyPartDoesNotHideTheOthers) {
  const auto mesh = load_mesh(write("parts.stl",
                                    "solid nothing\nendsolid nothing\nsolid part\nfacet normal 0 0 1\n"
                                    "outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                                    "endfacet\nendsolid part\n"));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 1U);
}

TEST_F(Scenes, AMotionIsNoShape) {
  expect_refused(write("walk.bvh",
                       "HIERARCHY\nROOT Hip\n{\n OFFSET 0 0 0\n CHANNELS 3 Xposition Yposition Zposition\n"
                       " JOINT Knee\n {\n  OFFSET 0 -1 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n"
                       "  End Site\n  {\n   OFFSET 0 -1 0\n  }\n }\n}\n"
                       "MOTION\nFrames: 1\nFrame Time: 0.03\n0 0 0 0 0 0\n"),
                 "holds no triangles");
}

/// Assimp takes the last point in place of one that does not exist: whoever relies on the shape must know.
// Tries wva_server: its importer had to leave something out
TEST_F(Scenes, WhatTheImporterMadeUpIsTold) {
  const auto mesh = load_mesh(write("face.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 7\n"),
                              {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, Contains(HasSubstr("its importer says: OFF: Vertex index is out of range")));
}

TEST_F(Scenes, FlawsOfLooksAreNotTold) {
  const auto mesh =
      load_mesh(write("part.obj", "o part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl nowhere\nf 1 2 3\n"),
                {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, IsEmpty());
}

// Tries wva_server: depends on a glTF extension
TEST_F(Scenes, SR27_ExtensionsOfGltfThatWouldChangeTheShapeAreRefused) {
  EXPECT_TRUE(load_mesh(write("plain.gltf", gltf(""))));
  EXPECT_TRUE(load_mesh(write("looks.gltf", gltf(R"(, "extensionsRequired": ["KHR_texture_transform"])"))));
  EXPECT_TRUE(load_mesh(write("optional.gltf", gltf(R"(, "extensionsUsed": ["VENDOR_notes"])"))));
  const auto refused = [&](const std::string& list, const std::string& extension) {
    expect_refused(
        write("part.gltf", gltf(", \"" + list + "\": [\"KHR_materials_unlit\", \"" + extension + "\"]")),
        "depends on the glTF extension " + extension);
  };
  refused("extensionsRequired", "KHR_mesh_quantization");
  refused("extensionsUsed", "KHR_mesh_quantization");
  refused("extensionsRequired", "EXT_meshopt_compression");
  refused("extensionsUsed", "EXT_mesh_gpu_instancing");
  refused("extensionsRequired", "VENDOR_of_tomorrow");
}

// Tries wva_server: depends on a glTF extension
TEST_F(Scenes, ExtensionsOfBinaryGltfToo) {
  std::string json = gltf(R"(, "extensionsRequired": ["KHR_mesh_quantization"])");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto number = [](std::size_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
    return bytes;
  };
  expect_refused(
      write("part.GLB", "glTF" + number(2) + number(20 + json.size()) + number(json.size()) + "JSON" + json),
      "KHR_mesh_quantization");
}

TEST_F(Scenes, FilesOfAGltfMayBeNamedByEncodedUris) {
  std::string text = gltf("");
  const std::size_t data = text.find("data:"), end = text.find('"', data);
  text.replace(data, end - data, "part%20one.bin");
  const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  write("part one.bin", {reinterpret_cast<const char*>(corners), sizeof corners});
  const auto mesh = load_mesh(write("part.gltf", text));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 1U);
}

// Tries wva_server: is a Git LFS pointer
TEST_F(Scenes, WhatStandsInPlaceOfAFileOfAGltfIsNamed) {
  std::string text = gltf("");
  const std::size_t data = text.find("data:"), end = text.find('"', data);
  text.replace(data, end - data, "part%20one.bin");
  write("part one.bin", "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 36\n");
  expect_refused(write("part.gltf", text),
                 "has the buffer 'part%20one.bin', which is a pointer of Git LFS, not the file itself");
  expect_refused(write("marked.gltf", "\xef\xbb\xbf" + gltf("")), "begins with a byte order mark");
}

TEST_F(Scenes, WhatOfAGltfsShapeIsNotAppliedIsNoted) {
  std::string text = gltf("");
  text.replace(text.find("\"primitives\""), 0, "\"weights\": [0, 0.5], ");
  auto mesh = load_mesh(write("morph.gltf", text));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, Contains(HasSubstr("morph targets with weights, which are not applied")));
  text.replace(text.find("0.5"), 3, "0.0");
  mesh = load_mesh(write("still.gltf", text), {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, IsEmpty());
}

TEST_F(Scenes, SR27_AGltfIsComparedWithTheCountsAndBoundsThatItDeclares) {
  const auto with = [](const std::string& what, const std::string& now) {
    std::string text = gltf("");
    return text.replace(text.find(what), what.size(), now);
  };
  auto mesh = load_mesh(write("twice.gltf", with(R"("scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}])",
                                                 R"("scenes": [{"nodes": [0, 1]}], "nodes": [{"mesh": 0},
 {"mesh": 0, "translation": [5, 0, 0], "children": [2]}, {"mesh": 0, "scale": [2, 2, 2]}])")),
                        {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 3U);
  EXPECT_THAT(mesh->notes, IsEmpty());
  mesh = load_mesh(write("beyond.gltf", with(R"("max": [1, 1, 0])", R"("max": [1, 0.5, 0])")),
                   {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes,
              Contains(HasSubstr("lie 0.500000 of its units beyond the bounds that it declares")));
  mesh = load_mesh(write("scenes.gltf", with(R"("scenes": [{"nodes": [0]}])",
                                             R"("scenes": [{"nodes": [0]}, {"nodes": []}])")),
                   {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, Contains(HasSubstr("has 2 scenes, of which number 0 is read")));
}

// Tries wva_server: is a Git LFS pointer
TEST_F(Scenes, AWebPageOrAnArchiveIsNamedForWhatItIs) {
  for (const char* name : {"part.stl", "part.obj", "part.ply", "part.glb", "part.dae"}) {
    expect_refused(write(name, "\n <!DOCTYPE HTML>\n<html><body>Not found</body></html>\n"),
                   "is a web page (HTML)");
    expect_refused(write(name, std::string("\x1f\x8b\b\0", 4)), "is compressed by gzip: unpack it");
    expect_refused(write(name, "PK\x03\x04 and more"), "is a ZIP archive: unpack it");
  }
  expect_refused(write("part.igs", std::string(72, ' ') + "S      1\n"), "is an IGES file of a CAD program");
  expect_refused(write("part.obj", std::string("\xff\xfev\0 \0", 6)), "(UTF-16)");
}

TEST_F(Scenes, UnitOfA3mfIsItsRootModels) {
  const std::string relationships =
      R"(<?xml version="1.0"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/Metadata/picture.png" Id="r1" Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>
 <Relationship Target="/3D/3dmodel.model" Id="r0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>)";
  const std::string model =
      R"(<?xml version="1.0"?>
<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1" type="model">
<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>
<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object></resources><build><item objectid="1"/></build></model>)";
  const auto mesh =
      load_mesh(write_archive("part.3mf", {{"3D/Objects/first.model", R"(<model unit="inch"></model>)"},
                                           {"_rels/.rels", relationships},
                                           {"3D/3dmodel.model", model}}));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->scale, 1.0);
  EXPECT_EQ(mesh->scale_from, KnownFrom::kFile);
}

}  // namespace
}  // namespace phantom::geometry
