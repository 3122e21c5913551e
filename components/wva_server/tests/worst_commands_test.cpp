// What a command may cost is counted, so that it is refused alike on every host: the dearest kinds of work
// count as much as they take. How long they take is measured by tests/bench/worst_commands.py.
#include <gmock/gmock.h>

#include <random>

#include "common/geometry/implicit/formula.hpp"
#include "common/runtime/cell/cell_objects.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::HasSubstr;

class WorstCommands : public TestCell {
 protected:
  /// Returns the reply to an object that is added where only so many million steps are allowed.
  std::string added(const std::string& yaml, std::uint64_t steps_millions) {
    AddLimits limits;
    limits.steps = steps_millions * 1'000'000;
    LiveCell live = activated(cell(), 7, limits);
    const auto change = live.apply(make_command(WorkspaceOperation::kAdd, "", 0, {}, yaml), 8, {});
    return change ? "added" : change.status().message();
  }
  /// A mesh file of triangles that lie anywhere, each alone.
  void write_soup(const std::string& name, int triangles) const {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(-150.0F, 150.0F), edge(-10.0F, 10.0F);
    geometry::TriangleMesh mesh;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(triangles); ++i) {
      const Eigen::Vector3f corner(place(random), place(random), place(random));
      for (int k = 0; k < 3; ++k)
        mesh.vertices_m.emplace_back(corner + Eigen::Vector3f(edge(random), edge(random), edge(random)));
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    write(name, ascii_stl(mesh));
  }
};

std::uint64_t work_of(const std::string& text) {
  const auto formula = geometry::Formula::parse(text, {"x", "y", "z"});
  EXPECT_TRUE(formula) << formula.status().message();
  return formula ? formula->work() : 0;
}

TEST_F(WorstCommands, FunctionsCountAsWhatTheyTake) {
  constexpr std::uint64_t kFunction = geometry::Formula::kFunctionWork;
  EXPECT_EQ(work_of("x + y*z - 2"), 7u);
  EXPECT_EQ(work_of("max(x, -y, abs(z))"), 7u);
  for (const char* name :
       {"sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "log10"})
    EXPECT_EQ(work_of(std::string(name) + "(x)"), 1 + kFunction) << name;
  EXPECT_EQ(work_of("pow(x, y)"), 2 + 2 * kFunction);
  EXPECT_EQ(work_of("x^2"), 2 + 2 * kFunction);
  EXPECT_EQ(work_of("length(x, y, z)"), 3 + 4 * kFunction);
}

// A cube in both cases, by as many operations that are asked as often.
TEST_F(WorstCommands, AFormulaOfDearFunctionsIsRefusedWhereOneOfSumsIsNot) {
  const auto cube = [](const std::string& function) {
    std::string chain = "x";
    for (int i = 0; i < 20; ++i) chain = function + "(" + chain + ")";
    return "{name: cube, implicit: {f: \"max(abs(x), abs(y), abs(z - 0.2)) - 0.05 + 0*(" + chain + "+" +
           chain + ")\", min_m: [-0.2, -0.2, 0.1], max_m: [0.2, 0.2, 0.4]}}";
  };
  EXPECT_EQ(added(cube("abs"), 7), "added");
  EXPECT_THAT(added(cube("sin"), 7), HasSubstr("takes more than 7 million steps"));
}

TEST_F(WorstCommands, WhatAWindingNumberLooksAtIsCountedAlsoForASingleVoxel) {
  write_soup("soup.stl", 3000);
  const std::string yaml =
      "{name: soup, mesh: soup.stl, mesh_scale: 0.001, up_axis: z, pose: {xyz_m: [0, 0, 0.2]}}";
  EXPECT_THAT(added(yaml, 2), HasSubstr("takes more than 2 million steps"));
  EXPECT_EQ(added(yaml, 1000), "added");
}

TEST_F(WorstCommands, WhatASearchForTheNearestTriangleLooksAtIsCounted) {
  const std::string yaml =
      "{name: ball2, mesh: ball.stl, mesh_scale: 0.001, up_axis: z, pose: {xyz_m: [0, 0.2, 0.2]}, profile: "
      "{thickness_vox: [10, 10], mu_Pa_s_per_m: [32, 20], mu_skin_Pa_s_per_m: 100, method: surface}}";
  EXPECT_THAT(added(yaml, 2), HasSubstr("takes more than 2 million steps"));
  EXPECT_EQ(added(yaml, 1000), "added");
}

TEST_F(WorstCommands, ADescriptionHasSoManyShapesThroughAliases) {
  const auto loaded = runtime::load_cell(cell());
  const auto shapes = [&](int count) {
    std::string yaml = "name: many\ncsg: {union: [&a {sphere: {radius_m: 0.05}}";
    for (int i = 1; i < count; ++i) yaml += ",*a";
    return yaml + "]}\n";
  };
  EXPECT_LE(shapes(4095).size(), 16384u);  // of a description
  EXPECT_NO_THROW(runtime::read_object_text(shapes(4095), loaded)) << "and the union itself: 4096";
  EXPECT_THROW(runtime::read_object_text(shapes(4096), loaded), core::ConfigError);
  EXPECT_THAT(added(shapes(4095), 100), HasSubstr("takes more than 100 million steps"));
}

}  // namespace
}  // namespace phantom::wva_server
