#include "common/geometry/mesh/mesh_io.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/stl.hpp"
#include "common/geometry/tests/mesh_files.hpp"

namespace phantom::geometry {
namespace {

using ::testing::HasSubstr;

TEST_F(MeshFiles, JoinsTheVerticesOfAnStl) {
  const auto mesh = load_mesh(write("box.stl", ascii_stl(make_box({0.2, 0.3, 0.4}))));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->vertices_m.size(), 8U);
  EXPECT_EQ(mesh->triangles.size(), 12U);
  EXPECT_NEAR(enclosed_volume_m3(*mesh), 0.024, 1e-8);
}

TEST_F(MeshFiles, ReadsABinaryStlWithoutAProcess) {
  const auto faults_of_children = [] {
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    return used.ru_minflt;
  };
  const TriangleMesh sphere = make_sphere(0.1, 3);
  const auto bytes = binary_stl(sphere);
  const auto stl = write("sphere.stl", {bytes.begin(), bytes.end()}),
             text = write("text.stl", ascii_stl(sphere));
  const long before = faults_of_children();
  const auto mesh = load_mesh(stl);
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), sphere.triangles.size());
  EXPECT_EQ(faults_of_children(), before);
  ASSERT_TRUE(load_mesh(text));
  EXPECT_GT(faults_of_children(), before);
}

TEST_F(MeshFiles, ScalesMillimetresToMetres) {
  const auto mesh = load_mesh(write("box.stl", ascii_stl(make_box({200, 300, 400}))), {.scale = 0.001});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_NEAR(enclosed_volume_m3(*mesh), 0.024, 1e-8);
}

TEST_F(MeshFiles, TurnsYUpIntoZUp) {
  const auto mesh = load_mesh(write("box.stl", ascii_stl(make_box({0.2, 0.3, 0.4}))), {.y_up = true});
  ASSERT_TRUE(mesh) << mesh.status().message();
  const BoundingBox box = mesh->bounding_box();
  EXPECT_TRUE((box.max_m - box.min_m).isApprox(Eigen::Vector3f(0.2F, 0.4F, 0.3F), 1e-6F));
  EXPECT_GT(enclosed_volume_m3(*mesh), 0);  // a rotation, not a mirror
}

TEST_F(MeshFiles, TriangulatesPolygons) {
  const auto mesh = load_mesh(write("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 2U);
  EXPECT_EQ(mesh->vertices_m.size(), 4U);
}

/// A triangle (0,0,0) (1,0,0) (0,1,0) under a node.
std::string collada(const std::string& asset, const std::string& node) {
  return R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset>)" +
         asset + R"(</asset>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
   <accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
   <param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node id="n">)" +
         node + R"(
  <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

/// x to the right, y and z as the corners of the triangle that collada() holds.
Eigen::Vector3f normal_of(const TriangleMesh& mesh) {
  const auto& t = mesh.triangles.at(0);
  return (mesh.vertices_m[t[1]] - mesh.vertices_m[t[0]])
      .cross(mesh.vertices_m[t[2]] - mesh.vertices_m[t[0]])
      .normalized();
}

TEST_F(MeshFiles, AppliesNodeTransforms) {
  const auto mesh =
      load_mesh(write("node.dae", collada(R"(<unit name="meter" meter="1"/><up_axis>Z_UP</up_axis>)",
                                          "<translate>5 6 7</translate>")));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_TRUE(mesh->bounding_box().min_m.isApprox(Eigen::Vector3f(5, 6, 7)));
  EXPECT_TRUE(normal_of(*mesh).isApprox(Eigen::Vector3f::UnitZ()));
}

TEST_F(MeshFiles, TurnsTheTrianglesOfMirroredNodesOver) {
  const auto mesh = load_mesh(
      write("node.dae", collada(R"(<unit meter="1"/><up_axis>Z_UP</up_axis>)", "<scale>-1 1 1</scale>")));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_FLOAT_EQ(mesh->bounding_box().min_m.x(), -1.0F);
  EXPECT_TRUE(normal_of(*mesh).isApprox(Eigen::Vector3f::UnitZ()));
}

TEST_F(MeshFiles, TakesUnitAndUpAxisFromCollada) {
  const std::string translate = "<translate>500 600 700</translate>";
  const std::string asset = R"(<unit name="cm" meter="0.01"/><up_axis>Y_UP</up_axis>)";
  const auto mesh = load_mesh(write("cm.dae", collada(asset, translate)));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->scale, 0.01);
  EXPECT_EQ(mesh->scale_from, KnownFrom::kFile);
  EXPECT_EQ(mesh->up, UpAxis::kY);
  EXPECT_EQ(mesh->up_from, KnownFrom::kFile);
  EXPECT_TRUE(mesh->notes.empty());
  EXPECT_TRUE(mesh->vertices_m[mesh->triangles[0][0]].isApprox(Eigen::Vector3f(5, -7, 6)));

  const auto x_up = load_mesh(
      write("x.dae", collada(R"(<unit meter="1"/><up_axis>X_UP</up_axis>)", "<translate>3 4 5</translate>")));
  ASSERT_TRUE(x_up) << x_up.status().message();
  EXPECT_TRUE(x_up->vertices_m[x_up->triangles[0][0]].isApprox(Eigen::Vector3f(-5, 4, 3)));

  const auto ours = load_mesh(write("cm.dae", collada(asset, translate)), {.scale = 0.001, .y_up = false});
  ASSERT_TRUE(ours) << ours.status().message();
  EXPECT_EQ(ours->scale_from, KnownFrom::kCaller);
  EXPECT_EQ(ours->up_from, KnownFrom::kCaller);
  EXPECT_TRUE(ours->vertices_m[ours->triangles[0][0]].isApprox(Eigen::Vector3f(0.5F, 0.6F, 0.7F)));
}

TEST_F(MeshFiles, GuessesTheUnitOfAnStlAndSaysSo) {
  const auto small = load_mesh(write("box.stl", ascii_stl(make_box({0.2, 0.3, 0.4}))));
  ASSERT_TRUE(small) << small.status().message();
  EXPECT_EQ(small->scale, 1.0);
  EXPECT_EQ(small->scale_from, KnownFrom::kGuess);
  EXPECT_EQ(small->up_from, KnownFrom::kGuess);
  ASSERT_EQ(small->notes.size(), 2U);
  EXPECT_THAT(small->notes[0], HasSubstr("metres are assumed, as its 0.2 × 0.3 × 0.4 units"));
  EXPECT_THAT(small->notes[1], HasSubstr("+z is assumed"));

  const auto large = load_mesh(write("box.stl", ascii_stl(make_box({200, 300, 400}))));
  ASSERT_TRUE(large) << large.status().message();
  EXPECT_EQ(large->scale, 0.001);
  EXPECT_THAT(large->notes[0], HasSubstr("millimetres are assumed, as its 200 × 300 × 400 units"));
  EXPECT_NEAR(enclosed_volume_m3(*large), 0.024, 1e-8);
}

TEST_F(MeshFiles, NamesAMissingFile) {
  const auto mesh = load_mesh(folder_ / "nowhere.stl");
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.status().code(), core::ErrorCode::kNotFound);
  expect_refused(folder_ / "nowhere.stl", "no such file");
}

TEST_F(MeshFiles, ReadsABinaryStlAsTheTextOfTheSame) {
  const TriangleMesh torus = make_torus(200, 51.3, 40, 20);
  const auto bytes = binary_stl(torus);
  const std::string binary(bytes.begin(), bytes.end());
  const MeshImportOptions turned{.scale = 0.0254, .y_up = true};
  for (const MeshImportOptions& options : {MeshImportOptions{}, turned}) {
    const auto from_text = load_mesh(write("text.stl", ascii_stl(torus)), options);
    const auto from_bytes = load_mesh(write("binary.STL", binary), options);
    ASSERT_TRUE(from_text) << from_text.status().message();
    ASSERT_TRUE(from_bytes) << from_bytes.status().message();
    ASSERT_EQ(from_bytes->vertices_m.size(), from_text->vertices_m.size());
    for (std::size_t i = 0; i < from_text->vertices_m.size();
         ++i)  // assimp reads numbers in text to seven digits
      EXPECT_LT((from_bytes->vertices_m[i] - from_text->vertices_m[i]).norm(),
                1e-6F * from_text->vertices_m[i].norm());
    EXPECT_EQ(from_bytes->triangles, from_text->triangles);
    EXPECT_EQ(from_bytes->format, from_text->format);
    EXPECT_EQ(from_bytes->scale, from_text->scale);
    EXPECT_EQ(from_bytes->up, from_text->up);
    EXPECT_EQ(from_bytes->notes, from_text->notes);
  }
  expect_refused(write("many.stl", binary), "more than 100 triangles", {.max_triangles = 100});
  std::string broken = binary;
  std::memset(broken.data() + 84 + 12, 0xff, 4);  // a corner that is not a number
  expect_refused(write("broken.stl", broken), "not a finite number");
  expect_refused(write("nothing.stl", std::string(84, '\0')), "holds no triangles");
}

// Tries wva_server: a mesh is empty; garbage
TEST_F(MeshFiles, RefusesWhatHoldsNoMesh) {
  expect_refused(folder_, "not a regular file");
  expect_refused(write("empty.stl", ""), "is empty");
  expect_refused(write("garbage.stl", std::string(5000, '\x5a')), "does not begin with 'solid'");
  expect_refused(write("noise.stl", std::string(5000, '\xa5')), "");
  expect_refused(write("part.unknown", "hello"), "by its ending 'unknown'); allowed: STL, OBJ");
  expect_refused(write("model.wrl", "#VRML V2.0 utf8\n"), "is in no format that is read");
  expect_refused(write("garbage.glb", "glTF and no more"), "holds something else than its ending 'glb' says");
  expect_refused(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "vertices and no faces");
  expect_refused(write("sliver.stl",
                       "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\n"
                       "vertex 1 0 0\nendloop\nendfacet\nendsolid s\n"),
                 "holds no triangles but 1 without extent");
}

// Tries wva_server: not finite; too large
TEST_F(MeshFiles, RefusesCoordinatesThatAreNotFinite) {
  expect_refused(write("nan.off", "OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n"), "");
  expect_refused(write("huge.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n"), "not a finite number",
                 {.scale = 1e20});
}

// Tries wva_server: too large
TEST_F(MeshFiles, RefusesTooManyTriangles) {
  expect_refused(write("sphere.stl", ascii_stl(make_sphere(1.0, 2))), "more than 100 triangles",
                 {.max_triangles = 100});
}

TEST_F(MeshFiles, RefusesAHeaderThatClaimsMoreThanThereIs) {
  std::string binary_stl(84, '\0');
  binary_stl[80] = '\xff';
  binary_stl[81] = '\xff';
  binary_stl[82] = '\xff';
  binary_stl[83] = '\x3f';
  expect_refused(write("claims.stl", binary_stl),
                 "53687091234 bytes long for the 1073741823 triangles that stand in its head; it has 84");
  expect_refused(write("claims.ply",
                       "ply\nformat ascii 1.0\nelement vertex 2000000000\nproperty float x\nproperty "
                       "float y\nproperty float z\nelement face 2000000000\nproperty list uchar int "
                       "vertex_indices\nend_header\n0 0 0\n"),
                 "it declares 2000000000 of 'vertex' and ends after 1: was it cut short?",
                 {.max_cpu_s = 2, .max_memory_bytes = 256 << 20});
}

/// The first child process of the main thread; 0 if there is none.
pid_t first_child() {
  std::ifstream children("/proc/self/task/" + std::to_string(getpid()) + "/children");
  pid_t child = 0;
  return children >> child ? child : 0;
}

/// Whether the process runs its own program already; until then its parent waits for it.
bool is_importer(pid_t process) {
  std::string name;
  return std::ifstream("/proc/" + std::to_string(process) + "/comm") >> name && name == "phantom_mesh_im";
}

// Tries wva_server: hangs it
TEST_F(MeshFiles, EndsAnImporterThatWaitsForEver) {
  const auto file = write("sphere.stl", ascii_stl(make_sphere(0.1, 6)));  // long enough to be caught at it
  std::jthread stopper([](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const pid_t child = first_child();
      if (child != 0 && is_importer(child) && kill(child, SIGSTOP) == 0) return;
    }
  });
  const auto mesh = load_mesh(file, {.max_cpu_s = 1});
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.status().message(), HasSubstr("was not read within 4 s"));
  EXPECT_EQ(first_child(), 0);
}

TEST_F(MeshFiles, WarnsOfATextStlThatWasCutShort) {
  const std::string whole = ascii_stl(make_box({0.2, 0.3, 0.4}));
  const auto last = whole.rfind("facet normal");
  const auto told = [&](const std::string& text) {
    const auto mesh = load_mesh(write("box.stl", text), {.scale = 1.0, .y_up = false});
    return mesh ? mesh->notes : std::vector<std::string>{mesh.status().message()};
  };
  EXPECT_THAT(told(whole), ::testing::IsEmpty());
  EXPECT_THAT(told(whole.substr(0, last)), ::testing::ElementsAre(HasSubstr("cut short")));
}

TEST_F(MeshFiles, SurvivesATruncatedPlyHeader) {
  expect_refused(write("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty flo"), "",
                 {.max_cpu_s = 2, .max_memory_bytes = 256 << 20});
}

/// Whatever stands in a file, the caller gets a mesh or a reason and lives on.
TEST_F(MeshFiles, SurvivesRandomDamage) {
  std::mt19937 random(11);
  const std::string whole[] = {ascii_stl(make_box({1, 1, 1})), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                               "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"};
  const char* names[] = {"damaged.stl", "damaged.off", "damaged.obj"};
  for (int round = 0; round < 30; ++round) {
    const int kind = round % 3;
    std::string text = whole[kind];
    for (int i = 0; i < 3; ++i) text[random() % text.size()] = static_cast<char>(random() % 256);
    text.resize(1 + random() % text.size());
    const auto mesh = load_mesh(write(names[kind], text), {.max_cpu_s = 2, .max_memory_bytes = 512 << 20});
    if (!mesh) {
      EXPECT_THAT(mesh.status().message(), HasSubstr(names[kind]));
    }
  }
}

}  // namespace
}  // namespace phantom::geometry
