#include "components/wva_server/wva_server.hpp"

#include <gmock/gmock.h>

#include "common/runtime/config_reader.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class WvaServer : public TestCell {
 protected:
  static ActivatedCell activated(const std::filesystem::path& file) {
    const auto cell = runtime::load_cell(file);
    double time_s = 0.0;  // a clock that ticks with every look
    return activate(
        grid_of(cell), load_bodies(cell, {}), 7, [&time_s] { return time_s += 1.0; }, [](const auto&...) {},
        [] { return true; });
  }
  static std::string refusal(const std::filesystem::path& file) {
    try {
      load_bodies(runtime::load_cell(file), {});
    } catch (const runtime::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
  static std::int8_t order_at(const voxel::Workspace& workspace, double x, double y, double z) {
    return workspace.order(workspace.grid().index_of({x, y, z}));
  }
};

TEST_F(WvaServer, ActivatesEveryObjectWhereTheModelHasIt) {
  const ActivatedCell result = activated(cell());
  ASSERT_TRUE(result.workspace);
  const voxel::Workspace& w = *result.workspace;
  EXPECT_EQ(w.version, 7U);
  EXPECT_EQ(w.grid().size_vox, (std::array<std::int32_t, 3>{80, 80, 50}));
  EXPECT_EQ(order_at(w, 0.001, 0.001, 0.301), voxel::kOrderInterior);  // not at its real deviation
  EXPECT_EQ(order_at(w, 0.075, 0.001, 0.301), 1);
  EXPECT_EQ(order_at(w, -0.201, 0.101, 0.15), voxel::kOrderInterior);
  EXPECT_EQ(w.object(w.grid().index_of({-0.201, 0.101, 0.15})), 2);
  EXPECT_EQ(w.object(w.grid().index_of({0.201, 0.101, 0.15})), 3);
  EXPECT_EQ(order_at(w, 0.235, 0.105, 0.155), voxel::kOrderGuard);
  EXPECT_EQ(w.mu(w.grid().index_of({0.235, 0.105, 0.155})), 25.0F);
  EXPECT_EQ(w.palette(), (std::vector<float>{0, 20, 25, 32, 90, 100}));
  EXPECT_GT(result.build_s, 0.0);
  ASSERT_EQ(result.objects.size(), 3U);
  EXPECT_THAT(describe(result.objects[0]), AllOf(HasSubstr("ball (object 1)"), HasSubstr("1280 triangles")));
}

TEST_F(WvaServer, TheSameCellGivesTheSameWorkspace) {
  EXPECT_EQ(activated(cell()).workspace->content_hash(), activated(cell()).workspace->content_hash());
}

TEST_F(WvaServer, TellsItsProgressAndEndsWhenAskedTo) {
  const auto loaded = runtime::load_cell(cell());
  const auto bodies = load_bodies(loaded, {});
  std::vector<std::size_t> done;
  const auto on_progress = [&](const ActivatedObject&, std::size_t n, std::size_t all) {
    EXPECT_EQ(all, 3U);
    done.push_back(n);
  };
  const auto result = activate(
      grid_of(loaded), bodies, 1, [] { return 0.0; }, on_progress, [&] { return done.size() < 2; });
  EXPECT_EQ(done, (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(result.workspace, nullptr);  // nothing half-made
}

TEST_F(WvaServer, SaysThatAMeshIsOpen) {
  std::string stl = ascii_stl(geometry::make_sphere(60, 3));
  const auto facet = stl.find("facet", stl.find("endfacet"));
  stl.erase(facet, stl.find("endfacet", facet) + 9 - facet);
  write("ball.stl", stl);
  const ActivatedCell result = activated(cell());
  EXPECT_FALSE(result.objects[0].report.mesh.closed);
  EXPECT_THAT(describe(result.objects[0]), HasSubstr("not closed"));
}

TEST_F(WvaServer, RefusesAMeshThatIsNone) {
  write("post.stl", "this is no mesh");
  EXPECT_THAT(refusal(cell()), AllOf(HasSubstr("cell.yaml: objects[1] 'left post'"), HasSubstr("post.stl")));
}

TEST_F(WvaServer, RefusesAnObjectOutsideOfTheWorkspace) {
  EXPECT_THAT(
      refusal(cell_with("xyz_m: [0.2, 0.1, 0.15]", "xyz_m: [2.0, 0.1, 0.15]")),
      AllOf(HasSubstr("'right post'"), HasSubstr("outside of the workspace"), HasSubstr("x 1.98 to 2.02")));
}

TEST_F(WvaServer, AcceptsAnObjectOutsideWhoseLayersReachIn) {
  EXPECT_EQ(refusal(cell_with("xyz_m: [0.2, 0.1, 0.15]", "xyz_m: [0.43, 0.1, 0.15]")), "accepted");
}

TEST_F(WvaServer, RefusesLayersThatReachTooFar) {
  EXPECT_THAT(refusal(cell_with("thickness_vox: [3]", "thickness_vox: [300]")),
              AllOf(HasSubstr("'right post'"), HasSubstr("allowed: at most 254")));
}

TEST_F(WvaServer, RefusesAMeshInTheWrongUnit) {
  EXPECT_THAT(refusal(cell_with("mesh_scale: 0.001, pose: {xyz_m: [-0.2, 0.1, 0.15]",
                                "mesh_scale: 1, pose: {xyz_m: [900.0, 0.1, 0.15]")),
              AllOf(HasSubstr("'left post'"), HasSubstr("mesh_scale")));
}

}  // namespace
}  // namespace phantom::wva_server
