// Live matter in the viewer's own pictures: its voxels' surface, and when it is made.
#include "components/synthetic_viewer/scene/live_shape.hpp"

#include <gmock/gmock.h>

#include <atomic>

#include "common/messages/living.hpp"
#include "components/synthetic_viewer/scene/live_shape_follower.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer::live_shape_test {
namespace {

using phantom::test::eventually;
using workspace::VoxelBox;

/// `solid` of live matter with one layer round it, beside a voxel of an object of the model.
std::shared_ptr<workspace::Workspace> cell_with(const VoxelBox& solid, std::uint64_t version = 1,
                                                std::uint16_t id = messages::kLiveId) {
  auto made = std::make_shared<workspace::Workspace>(
      workspace::GridSpec{{-0.5, 0.25, 1.0}, workspace::VoxelSize({0.01, 0.01, 0.02}), {64, 64, 64}},
      std::vector<float>{0.0F, 9.5F, 20.0F});
  made->version = version;
  const auto paint = [&](workspace::Index3 v, std::int8_t order, std::uint16_t object) {
    const auto brick = made->edit_brick(workspace::brick_of(v));
    const std::size_t at = workspace::brick_offset(v);
    brick.order[at] = order;
    brick.mu_code[at] = 1;
    brick.object[at] = object;
  };
  if (!solid.empty()) solid.grown(1).for_each([&](workspace::Index3 v) { paint(v, 1, id); });
  solid.for_each([&](workspace::Index3 v) { paint(v, workspace::kOrderBoundary, id); });
  paint({5, 6, 7}, workspace::kOrderBoundary, 9);
  return made;
}

TEST(LiveShape, IsTheClosedSurfaceOfItsBodiesWithoutTheirLayers) {
  const geometry::TriangleMesh shape =
      live_shapes(*cell_with({{28, 29, 30}, {10, 8, 6}})).at(messages::kLiveId);
  EXPECT_EQ(shape.triangles.size(), 12U);
  const geometry::BoundingBox box = shape.bounding_box();
  EXPECT_TRUE(box.min_m.isApprox(Eigen::Vector3f(-0.22F, 0.54F, 1.6F), 1e-6F)) << box.min_m.transpose();
  EXPECT_TRUE(box.max_m.isApprox(Eigen::Vector3f(-0.12F, 0.62F, 1.72F), 1e-6F)) << box.max_m.transpose();
  EXPECT_NEAR(geometry::enclosed_volume_m3(shape), 0.1 * 0.08 * 0.12, 1e-9) << "it faces outwards";
}

TEST(LiveShape, EachThingHasItsOwn) {
  EXPECT_TRUE(live_shapes(*cell_with({})).empty());
  const auto cell = cell_with({{28, 29, 30}, {10, 8, 6}}, 1, messages::kFirstLiveObjectId);
  const auto brick = cell->edit_brick(workspace::brick_of({50, 50, 50}));
  const std::size_t at = workspace::brick_offset({50, 50, 50});
  brick.order[at] = workspace::kOrderBoundary;
  brick.object[at] = messages::kFirstLiveObjectId + 1;
  const LiveShapes shapes = live_shapes(*cell);
  ASSERT_EQ(shapes.size(), 2U);
  EXPECT_NEAR(geometry::enclosed_volume_m3(shapes.at(messages::kFirstLiveObjectId)), 0.1 * 0.08 * 0.12, 1e-9);
  EXPECT_NEAR(geometry::enclosed_volume_m3(shapes.at(messages::kFirstLiveObjectId + 1)), 0.01 * 0.01 * 0.02,
              1e-9);
}

TEST(LiveShape, IsFollowedWhileThereIsLiveMatterAndGoesWithIt) {
  Inbox inbox;
  std::atomic<int> asked{0};
  std::atomic<std::uint64_t> version{1};
  const LiveShapeFollower follower(inbox, [&]() -> std::shared_ptr<const workspace::Workspace> {
    if (asked++ == 0) return nullptr;  // the workspace has not come yet
    return cell_with({{28, 29, 30}, {static_cast<std::int32_t>(version), 8, 6}}, version);
  });
  std::optional<LiveShapes> shapes;
  const auto comes = [&] { return (shapes = inbox.take_live_shapes()).has_value(); };
  inbox.live_matter = true;
  ASSERT_TRUE(eventually(comes));
  EXPECT_EQ(shapes->at(messages::kLiveId).triangles.size(), 12U);
  const int before = asked;
  ASSERT_TRUE(eventually([&] { return asked >= before + 2; }));
  EXPECT_FALSE(comes()) << "the same version";
  version = 2;
  EXPECT_TRUE(eventually(comes));
  inbox.live_matter = false;
  ASSERT_TRUE(eventually(comes));
  EXPECT_TRUE(shapes->empty());
}

}  // namespace
}  // namespace phantom::synthetic_viewer::live_shape_test
