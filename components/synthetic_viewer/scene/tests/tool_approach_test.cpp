// The view tool to object: the way between them, when it comes and goes, and from where it is seen.
#include "components/synthetic_viewer/scene/tool_approach.hpp"

#include <gmock/gmock.h>

#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/point_triangle.hpp"

namespace phantom::synthetic_viewer::tool_approach_test {
namespace {

using Eigen::Vector3d;

RayScene::Body box_at(const Vector3d& size_m, const Vector3d& at_m, std::uint16_t id) {
  geometry::Pose X;
  X.translation_m = at_m;
  return {std::make_shared<RayMesh>(geometry::make_box(size_m)), X, {id, 0}};
}

TEST(ToolGap, IsTheShortestWayToTheNearestObject) {
  RayScene objects;
  objects.bodies = {box_at({0.2, 0.2, 0.2}, {0, 0, 0}, 3), box_at({0.1, 0.04, 0.3}, {0.5, 0, 0}, 7)};
  const std::vector<Vector3d> tool{{0.2, 0.0, 0.05}, {0.3, 0.0, 0.05}};
  const auto gap = tool_gap(tool, objects, 0.5);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->object, 3);
  EXPECT_NEAR(gap->gap_m, 0.1, 1e-6);
  EXPECT_TRUE(gap->tool_m.isApprox(tool[0]));
  EXPECT_TRUE(gap->object_m.isApprox(Vector3d(0.1, 0.0, 0.05), 1e-6)) << gap->object_m.transpose();
  EXPECT_NEAR(gap->object_side_m, 0.2, 1e-6);
  objects.bodies.erase(objects.bodies.begin());
  const auto other = tool_gap(tool, objects, 0.5);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->object, 7);
  EXPECT_NEAR(other->gap_m, 0.15, 1e-6);
  EXPECT_NEAR(other->object_side_m, 0.04, 1e-6);
  EXPECT_FALSE(tool_gap(tool, objects, 0.14)) << "none is so near";
  EXPECT_FALSE(tool_gap({}, objects, 1.0));
}

TEST(RayMeshes, TheClosestPointIsThatOfALookAtEveryTriangle) {
  const geometry::TriangleMesh mesh = geometry::make_box({0.3, 0.2, 0.1});
  const RayMesh tree(mesh);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-0.4, 0.4);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p(within(random), within(random), within(random));
    double least = 1.0;
    for (const auto& [a, b, c] : mesh.triangles)
      least =
          std::min(least, (geometry::closest_point_on_triangle(p, Vector3d(mesh.vertices_m[a].cast<double>()),
                                                               Vector3d(mesh.vertices_m[b].cast<double>()),
                                                               Vector3d(mesh.vertices_m[c].cast<double>())) -
                           p)
                              .norm());
    const auto found = tree.closest(p, 1.0);
    ASSERT_TRUE(found);
    ASSERT_NEAR((*found - p).norm(), least, 1e-9);
    ASSERT_EQ(tree.closest(p, 0.05).has_value(), least < 0.05);
  }
}

class Approach : public ::testing::Test {
 protected:
  /// A gap along x of so many metres to an object that is 4 cm thick.
  static ToolGap gap_of(double gap_m) { return {7, {0.1, 0.2, 0.3}, {0.1 + gap_m, 0.2, 0.3}, gap_m, 0.04}; }
  HitView after(double duration_s) {
    HitView view;
    for (double t_s = 0.0; t_s < duration_s - 1e-9; t_s += 0.1) view = approach_.step(in_, all_, 0.1);
    return view;
  }
  const VisibleShare all_ = [](const ViewSituation&, const Vector3d&) { return 1.0; };
  ToolApproach approach_{ViewChoiceConfig{}};
  ToolApproach::Inputs in_;
};

TEST_F(Approach, ByIntentItComesWhenAnOpenGripperNearsWhatFitsAndGoesWithIt) {
  in_.open_m = 0.08;
  in_.gap = gap_of(0.12);
  EXPECT_EQ(after(1.0).alert, 0U) << "not near enough";
  in_.gap = gap_of(0.09);
  EXPECT_EQ(after(0.2).alert, 0U) << "passing by";
  const HitView shown = after(0.2);
  EXPECT_EQ(shown.alert, ToolApproach::kAlert);
  ASSERT_TRUE(shown.approach);
  EXPECT_EQ(shown.approach->object, 7);
  EXPECT_FALSE(shown.threatening);
  EXPECT_TRUE(shown.situation.look_at_m.isApprox(Vector3d(0.145, 0.2, 0.3)));
  in_.gap = gap_of(0.12);
  EXPECT_EQ(after(0.1).alert, ToolApproach::kAlert) << "it does not flicker";
  in_.gap = gap_of(0.16);
  EXPECT_EQ(after(0.1).alert, 0U);
  in_.gap = gap_of(0.09);
  in_.open_m = 0.03;
  EXPECT_EQ(after(1.0).alert, 0U) << "the object does not fit";
  in_.open_m.reset();
  EXPECT_EQ(after(1.0).alert, 0U) << "the gripper holds something, or there is none";
}

TEST_F(Approach, AskedForItIsShownWhileAnObjectIsInReach) {
  in_.asked = true;
  EXPECT_EQ(after(0.1).alert, 0U);
  in_.gap = gap_of(0.4);
  EXPECT_EQ(after(0.1).alert, ToolApproach::kAlert);
  in_.asked = false;
  EXPECT_EQ(after(0.1).alert, 0U);
}

TEST_F(Approach, ItIsSeenFromASideWhereNothingHidesTheGap) {
  in_.asked = true;
  in_.gap = gap_of(0.1);
  const HitView view = after(0.1);
  const Vector3d away = (view.eye_m - view.situation.look_at_m).normalized();
  EXPECT_LT(std::abs(away.dot(Vector3d::UnitX())), 0.6) << "lateral to the way";
  in_.chosen = ViewNode::kEast;
  EXPECT_EQ(after(0.1).node, ViewNode::kEast) << "the operator's choice";
}

}  // namespace
}  // namespace phantom::synthetic_viewer::tool_approach_test
