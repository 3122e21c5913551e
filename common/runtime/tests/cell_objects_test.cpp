#include "common/runtime/cell/cell_objects.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/core/errors.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "tests/support/captured_log.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Objects read from text, in a cell of 2 m with voxels of 5 mm.
class CellObjects : public testing::Test {
 protected:
  void SetUp() override {
    cell_.file = folder_ / "cell.yaml";
    cell_.min_m = Eigen::Vector3d::Constant(-1);
    cell_.max_m = Eigen::Vector3d::Constant(1);
    cell_.voxel_size_m = 0.005;
    cell_.profile.thickness_vox = {4, 4};
    cell_.profile.mu_Pa_s_per_m = {32, 20};
  }

  ObjectConfig read(const std::string& shape) const {
    return read_object_text("name: part\n" + shape + "\n", cell_);
  }
  workspace::LayerProfile profile(const std::string& text) const {
    return read("primitive: {sphere: {radius_m: 0.1}}\nprofile: {" + text + "}").profile;
  }
  /// Message of the refusal.
  std::string refused(const std::string& shape) const {
    try {
      read(shape);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
  std::string profile_refused(const std::string& text) const {
    return refused("primitive: {sphere: {radius_m: 0.1}}\nprofile: {" + text + "}");
  }
  static bool inside(const ObjectConfig& object, double x, double y, double z) {
    return object.solid_O->value({x, y, z}) < 0.0;
  }

  const std::filesystem::path folder_ = test::new_folder();
  CellConfig cell_;
};

TEST_F(CellObjects, ReadsEveryPrimitive) {
  EXPECT_NEAR(read("primitive: {sphere: {radius_m: 0.1}}").solid_O->value({0, 0, 0}), -0.1, 1e-12);
  EXPECT_NEAR(read("primitive: {box: {size_m: [0.2, 0.4, 0.6]}}").solid_O->value({0, 0, 0}), -0.1, 1e-12);
  EXPECT_NEAR(read("primitive: {cylinder: {radius_m: 0.3, height_m: 0.4}}").solid_O->value({0, 0, 0}), -0.2,
              1e-12);
  EXPECT_NEAR(
      read("primitive: {torus: {ring_radius_m: 0.3, tube_radius_m: 0.1}}").solid_O->value({0.3, 0, 0}), -0.1,
      1e-12);
  const ObjectConfig cone = read("primitive: {cone: {radius_m: 0.2, height_m: 0.4}}");
  EXPECT_TRUE(inside(cone, 0.19, 0, -0.199));
  EXPECT_FALSE(inside(cone, 0.02, 0, 0.199));
  const ObjectConfig prism = read("primitive: {prism: {corners_m: [0, 0, 0.2, 0, 0, 0.1], height_m: 0.4}}");
  EXPECT_TRUE(inside(prism, 0.05, 0.05, 0.19));
  EXPECT_FALSE(inside(prism, 0.15, 0.05, 0));
}

TEST_F(CellObjects, ReadsNestedCombinationsWithPoses) {
  const ObjectConfig object = read(R"(
csg:
  difference:
    - box: {size_m: [0.4, 0.2, 0.2]}
    - cylinder: {radius_m: 0.05, height_m: 1}
      pose: {xyz_m: [0.1, 0, 0], rpy_deg: [90, 0, 0]}
    - union:
        - sphere: {radius_m: 0.04}
          pose: {xyz_m: [-0.2, 0, 0]}
        - implicit: {f: "z", min_m: [-0.2, -0.1, -0.1], max_m: [-0.1, 0.1, 0.1]}
pose: {xyz_m: [0, 0, 0.5]})");
  EXPECT_TRUE(inside(object, 0.0, 0.0, 0.0)) << "in the object's own frame";
  EXPECT_FALSE(inside(object, 0.1, 0.09, 0.0)) << "the drilled hole runs along y";
  EXPECT_TRUE(inside(object, 0.1, 0.0, 0.09));
  EXPECT_FALSE(inside(object, -0.15, 0.0, -0.05));
  EXPECT_TRUE(inside(object, -0.15, 0.05, 0.05));
  EXPECT_EQ(object.X_WO.translation_m.z(), 0.5);
  EXPECT_TRUE(object.mesh.empty());
}

TEST_F(CellObjects, ScaleIsAboutTheObjectsOrigin) {
  const ObjectConfig object =
      read("implicit: {f: \"x^2 + y^2 + z^2 - 1\", min_m: [-1, -1, -1], max_m: [1, 1, 1]}\nscale: 0.1");
  EXPECT_TRUE(inside(object, 0.099, 0, 0));
  EXPECT_FALSE(inside(object, 0.101, 0, 0));
}

TEST_F(CellObjects, EachFaultOfAShapeIsNamed) {
  EXPECT_THAT(refused(""), HasSubstr("one of mesh, polyhedron, primitive, csg, implicit"));
  EXPECT_THAT(refused("mesh: a.stl\nprimitive: {sphere: {radius_m: 1}}"),
              HasSubstr("primitive: stands beside mesh"));
  EXPECT_THAT([&] { read("mesh: gone.stl"); },
              testing::ThrowsMessage<core::MissingError>(HasSubstr("mesh: 'gone.stl' is not there")));
  EXPECT_THAT(refused("primitive: {ball: {radius_m: 1}}"),
              HasSubstr("primitive: names no shape; allowed: one of sphere"));
  EXPECT_THAT(refused("primitive: {sphere: {radius_m: 1}, box: {size_m: [1, 1, 1]}}"),
              HasSubstr("stands beside"));
  EXPECT_THAT(refused("primitive: {sphere: {radius_m: 0}}"),
              HasSubstr("primitive.sphere.radius_m: '0' is out of range"));
  EXPECT_THAT(refused("primitive: {sphere: {radius: 1}}"),
              HasSubstr("primitive.sphere.radius_m: is missing"));
  EXPECT_THAT(refused("primitive: {sphere: {radius_m: 1, colour: 2}}"),
              HasSubstr("primitive.sphere.colour: unknown key"));
  EXPECT_THAT(refused("primitive: {box: {size_m: [1, 1]}}"), HasSubstr("needs three lengths"));
  EXPECT_THAT(refused("primitive: {prism: {corners_m: [0, 0, 1, 1, 2, 2], height_m: 1}}"),
              HasSubstr("are in line"));
  EXPECT_THAT(refused("primitive: {prism: {corners_m: [0, 0, 1, 1], height_m: 1}}"),
              HasSubstr("needs three corners"));
  EXPECT_THAT(refused("csg: {difference: []}"), HasSubstr("csg.difference: is empty"));
  EXPECT_THAT(refused("csg: {union: {sphere: {radius_m: 1}}}"), HasSubstr("a list of mappings"));
  EXPECT_THAT(refused("csg: {union: [{sphere: {radius_m: 1}, pos: 2}]}"),
              HasSubstr("csg.union[0].pos: unknown key (did you mean pose?)"));
  EXPECT_THAT(refused("implicit: {f: \"x + w\", min_m: [0, 0, 0], max_m: [1, 1, 1]}"),
              HasSubstr("implicit.f: 'x + w' is not a formula: column 5: 'w' is not known"));
  EXPECT_THAT(refused("implicit: {f: x, min_m: [0, 0, 0], max_m: [1, 0, 1]}"),
              HasSubstr("is not above min_m"));
  EXPECT_THAT(refused("implicit: {f: x, min_m: [0, 0, 0], max_m: [1, 1e5, 1]}"), HasSubstr("out of range"));
  EXPECT_THAT(refused("implicit: {f: x}"), HasSubstr("implicit.min_m: is missing"));
  EXPECT_THAT(refused("primitive: {sphere: {radius_m: 1}}\nmesh_scale: 0.1"),
              HasSubstr("mesh_scale: unknown key"));
  EXPECT_THAT(refused("primitive: {sphere: {radius_m: 1}}\nscale: 0"),
              HasSubstr("scale: '0' is out of range"));
}

TEST_F(CellObjects, APolyhedronIsAMeshInTheTextWithAGuardOfItsOwn) {
  const std::string corners = "vertices_m: [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1]",
                    triangles = "triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]";
  const ObjectConfig object =
      read("polyhedron: {" + corners + ", " + triangles + "}\nscale: 2\nguard_vox: 3");
  EXPECT_EQ(object.profile.guard_vox, 3);
  EXPECT_EQ(object.profile.thickness_vox, cell_.profile.thickness_vox) << "the layers stay the cell's";
  const CellBody body = load_body(object, cell_);
  EXPECT_NEAR(geometry::enclosed_volume_m3(body.mesh_O), 0.008 / 6, 1e-9);
  EXPECT_EQ(body.body.profile.guard_vox, 3);
  EXPECT_THAT(refused("polyhedron: {vertices_m: [0, 0, 0, 1], " + triangles + "}"),
              AllOf(HasSubstr("vertices_m"), HasSubstr("at least 4 corners")));
  EXPECT_THAT(refused("polyhedron: {" + corners + ", triangles: [0, 2, 1]}"),
              AllOf(HasSubstr("triangles"), HasSubstr("at least 4 triangles")));
  EXPECT_THAT(refused("polyhedron: {" + corners + ", triangles: [0, 2, 4, 0, 1, 3, 0, 3, 2, 1, 2, 3]}"),
              AllOf(HasSubstr("triangles"), HasSubstr("0 to 3")));
  EXPECT_THAT(refused("polyhedron: {" + corners + ", " + triangles + "}\nguard_vox: -1"),
              HasSubstr("guard_vox"));
  EXPECT_THAT(refused("polyhedron: {" + corners + ", " + triangles + "}\nmesh: a.stl"),
              HasSubstr("stands beside"));
}

TEST_F(CellObjects, NestingHasAnEnd) {
  std::string deep = "sphere: {radius_m: 1}";
  for (int i = 0; i < 40; ++i) deep = "union: [{" + deep + "}]";
  EXPECT_THAT(refused("csg: {" + deep + "}"), HasSubstr("nested too deeply"));
}

TEST_F(CellObjects, ATextIsReadAsStrictlyAsAFile) {
  EXPECT_THAT(
      refused("primitive: {sphere: {radius_m: 1}}\ncolor: [1, 0, 0]"),
      AllOf(HasSubstr("cell.yaml: object:3"), HasSubstr("color: unknown key (did you mean colour?)")));
  EXPECT_THAT(refused("primitive: ["), HasSubstr("not valid YAML"));
  EXPECT_EQ(read("primitive: {sphere: {radius_m: 1}}").profile.mu_Pa_s_per_m, cell_.profile.mu_Pa_s_per_m);
}

TEST_F(CellObjects, ProfilesByThesisSet) {
  const auto linear = profile("set: linear");
  EXPECT_THAT(linear.mu_Pa_s_per_m, ElementsAre(32, 29, 26, 23, 20, 17, 14, 11, 8, 5));
  EXPECT_EQ(linear.thickness_vox, std::vector<int>(10, 4));
  EXPECT_THAT(profile("set: nonlinear").mu_Pa_s_per_m, ElementsAre(32, 20, 13, 11, 10, 9, 8));
  EXPECT_THAT(profile("set: nonlinear_gentle").mu_Pa_s_per_m, ElementsAre(32, 25, 20, 17, 15, 13));
  const auto shorter = profile("set: nonlinear_short, layer_vox: 2");
  EXPECT_THAT(shorter.mu_Pa_s_per_m, ElementsAre(32, 20, 13, 11, 10, 8));
  EXPECT_EQ(shorter.thickness_vox, std::vector<int>(6, 2));
  EXPECT_EQ(shorter.mu_skin_Pa_s_per_m, 100.0F);
}

TEST_F(CellObjects, ProfilesByMultiplePassCylinder) {
  const std::string pipes = "mpc: {cylinder_diameter_m: 0.05, fluid_viscosity_Pa_s: 0.1, gamma: ";
  const std::string three =
      ", pipes: [{diameter_m: 0.01, length_m: 0.1, gap_m: 0.01}, {diameter_m: 0.01, length_m: 0.1, gap_m: "
      "0.01}, {diameter_m: 0.01, length_m: 0.1, gap_m: 0.02}]}";
  const auto stepped = profile(pipes + "stepped" + three);
  EXPECT_THAT(stepped.thickness_vox, ElementsAre(2, 2, 4));
  EXPECT_NEAR(stepped.mu_Pa_s_per_m.at(0), 157.08F, 0.01F);
  EXPECT_NEAR(stepped.mu_Pa_s_per_m.at(2), 157.08F / 3, 0.01F);
  EXPECT_EQ(stepped.mu_skin_Pa_s_per_m, stepped.mu_Pa_s_per_m[0]) << "not below the first layer's";
  const auto smooth = profile(pipes + "interpolated" + three);
  EXPECT_GT(smooth.mu_Pa_s_per_m.size(), 4U);
  EXPECT_EQ(smooth.reach_vox(), stepped.reach_vox());
}

// Tries wva_server: a pipe's gap is no whole number of voxels
TEST_F(CellObjects, LogsTheGapsOfACylinderThatAreNoWholeVoxels) {
  const test::CapturedLog log;
  const auto found = profile(
      "mpc: {cylinder_diameter_m: 0.05, fluid_viscosity_Pa_s: 0.1, pipes: ["
      "{diameter_m: 0.01, length_m: 0.1, gap_m: 0.004}, {diameter_m: 0.01, length_m: 0.1, gap_m: 0.006}, "
      "{diameter_m: 0.01, length_m: 0.1, gap_m: 0.012}, {diameter_m: 0.01, length_m: 0.1, gap_m: 0.015}]}");
  EXPECT_THAT(found.thickness_vox, ElementsAre(1, 1, 2, 3));
  const std::string text = log.text();
  for (const char* line :
       {"the gap of pipe 1 is 0.005 m instead of 0.004 m: gaps are whole voxels of 0.005 m",
        "the gap of pipe 2 is 0.005 m instead of 0.006 m: ",
        "the gap of pipe 3 is 0.01 m instead of 0.012 m: "})
    EXPECT_THAT(text, HasSubstr(line));
  EXPECT_THAT(text, testing::Not(HasSubstr("pipe 4")));
}

TEST_F(CellObjects, ProfilesByFunctionOfDistance) {
  const auto found = profile("function: {mu: \"40 * exp(-d / 0.05)\", reach_m: 0.06, layer_vox: 2}");
  ASSERT_EQ(found.mu_Pa_s_per_m.size(), 6U);
  EXPECT_EQ(found.thickness_vox, std::vector<int>(6, 2));
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(found.mu_Pa_s_per_m[i], 40 * std::exp(-(0.005 + 0.01 * static_cast<double>(i)) / 0.05), 1e-4);
}

TEST_F(CellObjects, ProfilesSayHowLayersAreMade) {
  const auto found = profile(
      "set: linear, method: dilation, element: sphere-contained, guard_vox: 2,"
      " inside: {thickness_vox: [2, 3], mu_Pa_s_per_m: [50, 80]}");
  EXPECT_EQ(found.method, workspace::LayerMethod::kDilation);
  EXPECT_EQ(found.element, workspace::ShapingElement::kSphereContained);
  EXPECT_EQ(found.guard_vox, 2);
  EXPECT_THAT(found.inside_thickness_vox, ElementsAre(2, 3));
  EXPECT_THAT(found.mu_inside_Pa_s_per_m, ElementsAre(50, 80));
  EXPECT_EQ(profile("set: linear, method: surface").method, workspace::LayerMethod::kSurface);
  EXPECT_EQ(profile("set: linear, method: dilation, element: cube").element,
            workspace::ShapingElement::kCube);
  EXPECT_EQ(profile("set: linear").method, workspace::LayerMethod::kDistance);
}

// Tries wva_server: a profile that does not fall outwards
// Tries wva_server: reaches too far
TEST_F(CellObjects, EachFaultOfAProfileIsNamed) {
  EXPECT_THAT(profile_refused("set: steep"),
              HasSubstr("profile.set: 'steep' is not known; allowed: linear, nonlinear,"));
  EXPECT_THAT(profile_refused("set: linear, mpc: {}"), HasSubstr("profile.mpc: stands beside set"));
  EXPECT_THAT(profile_refused("method: distance"), HasSubstr("profile.thickness_vox: is missing"));
  EXPECT_THAT(profile_refused("set: linear, thickness_vox: [1]"),
              HasSubstr("profile.thickness_vox: unknown key"));
  EXPECT_THAT(profile_refused("set: linear, element: cube"), HasSubstr("belongs to method: dilation"));
  EXPECT_THAT(profile_refused("set: linear, method: guess"),
              HasSubstr("allowed: distance, surface, dilation"));
  EXPECT_THAT(profile_refused("set: linear, method: dilation, element: round"),
              HasSubstr("allowed: cube, sphere, sphere-contained"));
  EXPECT_THAT(profile_refused("set: linear, mu_skin_Pa_s_per_m: 20"), HasSubstr("below the first layer's"));
  EXPECT_THAT(profile_refused("set: linear, inside: {thickness_vox: [2], mu_Pa_s_per_m: [30]}"),
              HasSubstr("does not rise inwards"));
  EXPECT_THAT(profile_refused("set: linear, inside: {thickness_vox: [2, 2], mu_Pa_s_per_m: [40]}"),
              HasSubstr("inside the body"));
  EXPECT_THAT(profile_refused("function: {mu: \"10 + d\", reach_m: 0.1}"),
              HasSubstr("allowed: a function that falls with d"));
  EXPECT_THAT(profile_refused("function: {mu: \"1 - 20*d\", reach_m: 0.1}"),
              HasSubstr("allowed: 1e-6 to 1e6"));
  EXPECT_THAT(profile_refused("function: {mu: \"log(d - 1)\", reach_m: 0.1}"),
              HasSubstr("has no value at d = 0.002500 m"));
  EXPECT_THAT(profile_refused("function: {mu: \"exp(-x)\", reach_m: 0.1}"),
              HasSubstr("'x' is not known; allowed: d pi e"));
  EXPECT_THAT(profile_refused("function: {mu: \"exp(-d)\", reach_m: 2}"), HasSubstr("98 layers at most"));
  EXPECT_THAT(
      profile_refused(
          "mpc: {cylinder_diameter_m: 0.05, fluid_viscosity_Pa_s: 0.1, pipes: [{diameter_m: 0.1, length_m: "
          "0.1, gap_m: 0.01}]}"),
      HasSubstr("pipe 1 of diameter 0.1 m; allowed: above 0, up to the cylinder's"));
  EXPECT_THAT(profile_refused("mpc: {cylinder_diameter_m: 0.05, fluid_viscosity_Pa_s: 0.1}"),
              HasSubstr("no pipes"));
  EXPECT_THAT(profile_refused("thickness_vox: [300], mu_Pa_s_per_m: [10]"),
              HasSubstr("allowed: at most 254"));
}

TEST_F(CellObjects, BodiesByFormulaCarryFormulaAndSurface) {
  ObjectConfig object = read("primitive: {box: {size_m: [0.2, 0.2, 0.2]}}\npose: {xyz_m: [0.5, 0, 0]}");
  object.id = 7;
  const CellBody body = load_body(object, cell_);
  EXPECT_EQ(body.body.id, 7);
  EXPECT_NEAR(body.body.implicit_W->value({0.5, 0, 0}), -0.1, 1e-12);
  EXPECT_NEAR(geometry::enclosed_volume_m3(body.mesh_O), 0.008, 1e-6);
  EXPECT_NEAR(body.body.mesh_W.bounding_box().max_m.x(), 0.6, 1e-6);
  EXPECT_TRUE(body.notes.empty());
}

TEST_F(CellObjects, BodiesThatCannotBeAreRefusedByName) {
  const auto refusal = [&](const std::string& shape) {
    try {
      load_body(read(shape), cell_);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refusal("primitive: {sphere: {radius_m: 0.1}}\npose: {xyz_m: [5, 0, 0]}"),
              AllOf(HasSubstr("'part'"), HasSubstr("outside of the workspace"), HasSubstr("x 4.9 to 5.1")));
  EXPECT_THAT(refusal("implicit: {f: \"x^2 + 1\", min_m: [0, 0, 0], max_m: [1, 1, 1]}"),
              HasSubstr("holds nothing"));
}

// A pipe in survey coordinates, which a pose brings into the cell: numbers of 32 bits cannot hold it.

// Tries wva_server: lies far from its origin
TEST_F(CellObjects, AMeshFarFromItsOriginIsRefusedOrWarnedOf) {
  const auto load_at = [&](double x_m) {
    auto mesh = geometry::make_cylinder(0.05, 0.4);
    std::ofstream file(folder_ / "pipe.obj");
    file.precision(15);
    for (const auto& v : mesh.vertices_m)
      file << "v " << static_cast<double>(v.x()) + x_m << ' ' << v.y() << ' ' << v.z() << '\n';
    for (const auto& t : mesh.triangles)
      file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    file.close();
    return load_body(read("mesh: pipe.obj\nmesh_scale: 1\nup_axis: z\npose: {xyz_m: [" +
                          std::to_string(-x_m) + ", 0, 0]}"),
                     cell_);
  };
  EXPECT_THAT(load_at(0.0).notes, testing::IsEmpty());
  EXPECT_THAT(load_at(1000.0).notes, testing::IsEmpty());
  EXPECT_THAT(load_at(5000.0).notes,
              ElementsAre(AllOf(HasSubstr("reaches 5000.05 m from its origin"),
                                HasSubstr("rounded to 0.00049 m, too coarse for a voxel of 0.005 m"))));
  EXPECT_THAT([&] { load_at(512345.678); },
              ThrowsMessage<ConfigError>(
                  AllOf(HasSubstr("'part': reaches 512346 m"), HasSubstr("origin near to it"))));
}

/// However fine the file's numbers are, those of the placed mesh have 32 bits, too.
TEST_F(CellObjects, AMeshThatIsPosedFarFromTheOriginIsRefusedAndAShapeOfFormulasIsNot) {
  const std::string tetrahedron =
      "polyhedron: {vertices_m: [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1], "
      "triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]}\n";
  const auto load_at = [&](const std::string& shape, double x_m) {
    CellConfig far = cell_;
    far.min_m.x() += x_m;
    far.max_m.x() += x_m;
    return load_body(read(shape + "pose: {xyz_m: [" + std::to_string(x_m) + ", 0, 0.1]}"), far);
  };
  EXPECT_NO_THROW(load_at(tetrahedron, 1000.0));
  EXPECT_THAT(
      [&] { load_at(tetrahedron, 450000.0); },
      ThrowsMessage<ConfigError>(AllOf(HasSubstr("'part': pose: it reaches 450000 m from the origin of W"),
                                       HasSubstr("rounded to 0.031 m, too coarse for a voxel of 0.005 m"))));
  EXPECT_NO_THROW(load_at("primitive: {sphere: {radius_m: 0.1}}\n", 450000.0));
}

TEST_F(CellObjects, NamesCanBeShownAndSent) {
  const auto refusal = [&](const std::string& name) {
    try {
      read_object_text("name: " + name + "\nprimitive: {sphere: {radius_m: 0.1}}\n", cell_);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusal("gefäß 部品"), "accepted");
  EXPECT_EQ(refusal(std::string(64, 'x')), "accepted");
  EXPECT_THAT(refusal(std::string(65, 'x')), HasSubstr("has 65 bytes; allowed: 1 to 64"));
  EXPECT_THAT(refusal("\"\""), HasSubstr("has 0 bytes"));
  for (const char* odd : {"\"two\\nlines\"", "\"a\\0b\"", "\"\\x1b[31mred\"", "\"\\uD800\""})
    EXPECT_THAT(refusal(odd), AnyOf(HasSubstr("object:1: name: holds a character that cannot be shown"),
                                    HasSubstr("not valid YAML")))
        << odd;
}

TEST_F(CellObjects, RealBodiesStandWhereTheirDeviationPutsThem) {
  cell_.objects.push_back(
      read("primitive: {sphere: {radius_m: 0.1}}\nreal_deviation: {xyz_m: [0.01, 0, 0]}"));
  EXPECT_NEAR(load_real_bodies(cell_).at(0).mesh_W.bounding_box().max_m.x(), 0.11, 1e-4);
  EXPECT_NEAR(load_bodies(cell_).at(0).body.mesh_W.bounding_box().max_m.x(), 0.1, 1e-4);
}

TEST_F(CellObjects, LooseOnesAndThoseThatAnArmCarriesAreNoneOfTheFixedBodies) {
  const std::string ball = "primitive: {sphere: {radius_m: 0.1}}\n";
  EXPECT_THAT(refused(ball + "loose: true"), HasSubstr("loose: 'true' needs mass_kg"));
  EXPECT_THAT(refused(ball + "mass_kg: 1\nloose: true\nhold: {arm: a}"),
              HasSubstr("loose: 'true' does not go with hold"));
  cell_.objects.push_back(read(ball + "mass_kg: 2\nloose: true\nreal_deviation: {xyz_m: [0.01, 0, 0]}"));
  cell_.objects.push_back(read(ball + "hold: {arm: a}"));
  cell_.objects.push_back(read(ball + "hold: {frame: tool}"));
  EXPECT_EQ(load_real_bodies(cell_).size(), 1U) << "the last";
  const auto loose = load_loose_bodies(cell_);
  ASSERT_EQ(loose.size(), 1U);
  EXPECT_EQ(loose[0].mass_kg, 2.0);
  EXPECT_NEAR(loose[0].X_WO.translation_m.x(), 0.01, 1e-12);
  EXPECT_NEAR(loose[0].mesh_O.bounding_box().max_m.x(), 0.1, 1e-4);
}

TEST_F(CellObjects, AProtectedZoneIsNoBody) {
  const std::string ball = "primitive: {sphere: {radius_m: 0.1}}\n", zone = ball + "kind: protected_zone\n";
  EXPECT_FALSE(read(ball).is_zone());
  EXPECT_FALSE(read(ball + "kind: solid").is_zone());
  EXPECT_TRUE(read(zone).is_zone());
  EXPECT_EQ(read(zone + "pose_error_m: 0.01").profile.guard_vox, 2) << "where it is may be unsure, too";
  EXPECT_THAT(refused(ball + "kind: wall"), HasSubstr("allowed: solid, protected_zone"));
  for (const char* of_a_body : {"mass_kg: 1", "max_contact_force_N: 5", "mass_kg: 1\nloose: true",
                                "hold: {frame: tool}", "real_deviation: {xyz_m: [0.01, 0, 0]}"})
    EXPECT_THAT(refused(zone + of_a_body), HasSubstr("does not go with kind: protected_zone")) << of_a_body;
  const std::string inside = "inside: {thickness_vox: [2], mu_Pa_s_per_m: [50], stiffness_Pa_per_m: [1e6]}";
  EXPECT_THAT(refused(zone + "profile: {set: nonlinear, " + inside + "}"),
              HasSubstr("has layers inside the body"));
  cell_.profile.inside_thickness_vox = {2};
  cell_.profile.mu_inside_Pa_s_per_m = {50};
  cell_.profile.stiffness_inside_Pa_per_m = {1e6};
  EXPECT_TRUE(read(zone).profile.inside_thickness_vox.empty()) << "of the cell's profile they are left out";
  EXPECT_TRUE(read(zone).profile.stiffness_inside_Pa_per_m.empty());
  EXPECT_FALSE(read(ball).profile.inside_thickness_vox.empty());
  cell_.objects = {read(ball), read(zone)};
  EXPECT_EQ(load_real_bodies(cell_).size(), 1U) << "nothing can touch a zone";
  const auto bodies = load_bodies(cell_);
  EXPECT_TRUE(bodies.at(0).body.solid);
  EXPECT_FALSE(bodies.at(1).body.solid);
}

TEST_F(CellObjects, TheErrorOfAPoseGrowsTheGuard) {
  const std::string ball = "primitive: {sphere: {radius_m: 0.1}}\n";
  const double side_m = cell_.voxel_size_m.reference_m();
  EXPECT_EQ(read(ball).pose_error_m, 0.0);
  EXPECT_EQ(read(ball).profile.guard_vox, cell_.profile.guard_vox);
  const auto error = [&](double voxels) { return ball + "pose_error_m: " + std::to_string(voxels * side_m); };
  EXPECT_EQ(read(error(2.0)).profile.guard_vox, std::max(2, cell_.profile.guard_vox));
  EXPECT_EQ(read(error(2.2)).profile.guard_vox, 3);
  EXPECT_EQ(read(error(2.2) + "\nguard_vox: 5").profile.guard_vox, 5) << "the greater one holds";
  EXPECT_THAT(refused(ball + "pose_error_m: -0.1"), HasSubstr("pose_error_m"));
  EXPECT_EQ(read(ball + "max_contact_force_N: 12").max_contact_force_N, 12.0);
  EXPECT_THAT(refused(ball + "max_contact_force_N: -1"), HasSubstr("max_contact_force_N"));
}

TEST_F(CellObjects, AliasesThatMakeMuchOfLittleAreRefused) {
  std::string text = "csg_0: &s0 {sphere: {radius_m: 0.1}}\n";
  std::string last = "s0";
  for (int level = 1; level <= 5; ++level) {
    const std::string name = "s" + std::to_string(level);
    text += "k" + name + ": &" + name + " {union: [";
    for (int i = 0; i < 6; ++i) text += (i == 0 ? "*" : ", *") + last;
    text += "]}\n";
    last = name;
  }
  EXPECT_THAT([&] { read(text + "csg: *" + last); },
              ThrowsMessage<ConfigError>(AllOf(HasSubstr("aliases"), HasSubstr("allowed: at most"))));
  EXPECT_THAT([&] { read("csg: &a {union: [*a]}"); }, ThrowsMessage<ConfigError>(HasSubstr("cell.yaml")));
}

}  // namespace
}  // namespace phantom::runtime
