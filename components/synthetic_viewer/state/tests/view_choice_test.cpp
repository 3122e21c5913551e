#include <gtest/gtest.h>

#include <array>

#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/render/ray_scene.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::synthetic_viewer {
namespace {

using percept::kNodeCount;
using percept::node_direction;
using percept::node_from_number;

const VisibleShare kAllSeen = [](const ViewSituation&, const Eigen::Vector3d&) { return 1.0; };

// Property: with everything in sight, the view is lateral whatever the direction of the PGV.
TEST(ViewChooser, LooksFromTheSide) {
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d pgv = Eigen::Vector3d(std::sin(k), std::cos(1.7 * k), std::sin(2.3 * k + 1)) * 0.02;
    ViewChooser chooser({});
    const ViewNode node =
        chooser.step({Eigen::Vector3d(0.1, 0.2, 0.3), pgv, ViewNode::kAutomatic}, kAllSeen, 0.1);
    double best = 1;  // the best that any node could do
    for (int number = 1; number <= kNodeCount; ++number) {
      best = std::min(best, std::abs(node_direction(*node_from_number(number)).dot(pgv.normalized())));
    }
    EXPECT_LE(std::abs(node_direction(node).dot(pgv.normalized())), std::max(0.45, best + 0.2)) << k;
  }
}

TEST(ViewChooser, TakesAnyGoodNodeWithoutADirection) {
  ViewChooser chooser({});
  const ViewNode node = chooser.step({}, kAllSeen, 0.1);
  EXPECT_NE(node, ViewNode::kAutomatic);
  EXPECT_GE(node_direction(node).z(), 0);
}

RayScene::Body body(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& place) {
  return {std::make_shared<RayMesh>(mesh), {Eigen::Matrix3d::Identity(), place}};
}

// The contact is at the bottom of a well that is open towards +y only: of all nodes, N alone sees the gap.
TEST(ViewChooser, FindsTheOneNodeThatSeesTheGap) {
  RayScene scene;
  scene.bodies = {body(geometry::make_box({0.4, 0.02, 0.4}), {0, -0.1, 0}),
                  body(geometry::make_box({0.02, 0.4, 0.4}), {0.1, 0.1, 0}),
                  body(geometry::make_box({0.02, 0.4, 0.4}), {-0.1, 0.1, 0}),
                  body(geometry::make_box({0.4, 0.4, 0.02}), {0, 0.1, 0.1}),
                  body(geometry::make_box({0.4, 0.4, 0.02}), {0, 0.1, -0.1})};
  const VisibleShare visible = [&scene](const ViewSituation& situation, const Eigen::Vector3d& eye_m) {
    return scene.visible_share(situation.look_at_m, situation.pgv, 0.02, eye_m);
  };
  for (const Eigen::Vector3d& pgv :
       {Eigen::Vector3d(0.02, 0, 0), Eigen::Vector3d(0, 0, -0.02), Eigen::Vector3d(0, -0.02, 0)}) {
    ViewChooser chooser({});
    EXPECT_EQ(chooser.step({Eigen::Vector3d::Zero(), pgv, ViewNode::kAutomatic}, visible, 0.1),
              ViewNode::kNorth);
  }
}

// N and S are the only nodes in sight, and take turns at being a little or much better.
class Steady : public ::testing::Test {
 protected:
  ViewNode step(double north, double south, double dt_s) {
    return chooser_.step(
        {Eigen::Vector3d::Zero(), {0.02, 0, 0}, ViewNode::kAutomatic},
        [=](const ViewSituation&, const Eigen::Vector3d& eye_m) {
          return eye_m.y() > 0.5 ? north : eye_m.y() < -0.5 ? south : 0.0;
        },
        dt_s);
  }
  ViewChooser chooser_{{.distance_m = 0.6, .margin = 0.12, .dwell_s = 0.6, .least_stay_s = 1.5}};
};

TEST_F(Steady, SmallDifferencesDoNotMoveTheView) {
  EXPECT_EQ(step(1.0, 0.9, 0.1), ViewNode::kNorth);
  for (int k = 0; k < 200; ++k) EXPECT_EQ(step(0.92, 1.0, 0.1), ViewNode::kNorth);
}

TEST_F(Steady, AShortOcclusionDoesNotMoveTheView) {
  EXPECT_EQ(step(1.0, 0.5, 0.1), ViewNode::kNorth);
  for (int k = 0; k < 100; ++k)
    EXPECT_EQ(k % 6 == 0 ? step(1.0, 1.0, 0.1) : step(0.0, 1.0, 0.1), ViewNode::kNorth);
}

TEST_F(Steady, ALastingOcclusionMovesItOnceItHasStayedLongEnough) {
  EXPECT_EQ(step(1.0, 0.5, 0.1), ViewNode::kNorth);
  double moved_s = 0;
  for (int k = 1; k <= 40 && moved_s == 0; ++k) {
    if (step(0.0, 1.0, 0.1) == ViewNode::kSouth) moved_s = 0.1 * k;
  }
  EXPECT_NEAR(moved_s, 1.5, 0.11);
}

TEST_F(Steady, AnOscillatingSceneChangesTheViewSeldom) {
  int changes = 0;
  ViewNode last = step(1.0, 0.0, 0.1);
  for (int k = 0; k < 600; ++k) {  // a minute; the better side changes every second
    const bool north = (k / 10) % 2 == 0;
    const ViewNode now = step(north ? 1.0 : 0.0, north ? 0.0 : 1.0, 0.1);
    changes += now != last;
    last = now;
  }
  EXPECT_LE(changes, 40);
}

TEST(ViewChooser, TheOperatorsChoiceHoldsAtOnceAndWhateverIsSeen) {
  ViewChooser chooser({});
  const VisibleShare nothing = [](const ViewSituation&, const Eigen::Vector3d&) { return 0.0; };
  EXPECT_EQ(chooser.step({{}, {0.02, 0, 0}, ViewNode::kCorner7}, nothing, 0.0), ViewNode::kCorner7);
  EXPECT_EQ(chooser.step({{}, {0.02, 0, 0}, ViewNode::kBottom}, nothing, 0.01), ViewNode::kBottom);
}

TEST(ViewChooser, StepDoesNotAllocate) {
  RayScene scene;
  scene.bodies = {body(geometry::make_sphere(0.2, 3), {0.3, 0, 0})};
  const VisibleShare visible = [&scene](const ViewSituation& situation, const Eigen::Vector3d& eye_m) {
    return scene.visible_share(situation.look_at_m, situation.pgv, 0.02, eye_m);
  };
  SyntheticViewer viewer({});
  const phantom::test::HeapGuard guard;
  viewer.take({1, false, {0, 0, 0.5}, {0.01, 0, 0}});
  const ThreatPlace threat{0, 0, {0, 0.1, 0.5}, {0.01, 0, 0}};
  viewer.follow({&threat, 1});
  for (int k = 0; k < 50; ++k) viewer.step(false, ViewNode::kAutomatic, visible, 0.1);
  viewer.take({1, true, {}, {}});
  viewer.step(true, ViewNode::kTop, visible, 0.1);
}

class HitViews : public ::testing::Test {
 protected:
  HitView step(double dt_s, bool hold = false) {
    return viewer_.step(hold, ViewNode::kAutomatic, kAllSeen, dt_s);
  }
  void raise(std::uint32_t alert) { viewer_.take({alert, false, {0.1 * alert, 0, 0}, {0, 0, -0.01}}); }
  void clear(std::uint32_t alert) { viewer_.take({alert, true, {}, {}}); }
  SyntheticViewer viewer_{{.choice = {}, .least_show_s = 1.0, .hold_after_clear_s = 3.0}};
};

/// An alert of link 3 near object 7, and where that threat is later.
class FollowedThreat : public HitViews {
 protected:
  void begin(const Eigen::Vector3d& at_m) {
    viewer_.take({1, false, at_m, {0, 0, -0.01}, 3, 7});
    step(0.1);
  }
  HitView threaten(const Eigen::Vector3d& at_m, const Eigen::Vector3d& pgv, double seconds,
                   bool hold = false) {
    HitView view;
    for (double passed_s = 0.0; passed_s < seconds - 0.05; passed_s += 0.1) {
      const std::array threats{ThreatPlace{2, 7, {9, 9, 9}, pgv}, ThreatPlace{3, 8, {8, 8, 8}, pgv},
                               ThreatPlace{3, 7, at_m, pgv}};
      viewer_.follow(threats);
      view = step(0.1, hold);
    }
    return view;
  }
};

TEST_F(FollowedThreat, TheLookAtPointMovesWithItsOwnThreat) {
  begin({0, 0, 0});
  const HitView slid = threaten({0.3, 0, 0}, {0, 0, -0.01}, 2.0);
  EXPECT_EQ(slid.alert, 1U);
  EXPECT_TRUE(slid.situation.look_at_m.isApprox(Eigen::Vector3d(0.3, 0, 0), 1e-3)) << "it slid along";
  EXPECT_TRUE(slid.eye_m.isApprox(slid.situation.look_at_m + 0.6 * node_direction(slid.node), 1e-9))
      << "and the camera with it";
}

TEST_F(FollowedThreat, ALeapToAnotherSensorMovesItSmoothly) {
  begin({0, 0, 0});
  double before_m = 0.0;
  for (int k = 0; k < 20; ++k) {
    const double now_m = threaten({0.2, 0, 0}, {0, 0, -0.01}, 0.1).situation.look_at_m.x();
    EXPECT_LT(now_m - before_m, 0.5 * 0.2);
    EXPECT_GE(now_m, before_m);
    before_m = now_m;
  }
}

TEST_F(FollowedThreat, TheNodeIsChosenForWhereItIsNow) {
  begin({0, 0, 0});
  const HitView first = threaten({0, 0, 0}, {0, 0, -0.01}, 2.0);
  EXPECT_LT(std::abs(node_direction(first.node).z()), 0.45);
  const Eigen::Vector3d along =
      node_direction(first.node);  // the object is straight behind, or before, it now
  const HitView later = threaten({0, 0, 0}, 0.01 * along, 3.0);
  EXPECT_NE(later.node, first.node);
  EXPECT_LT(std::abs(node_direction(later.node).dot(along)), 0.6) << "lateral again";
}

TEST_F(FollowedThreat, WhatIsHeldOverOrGoneStaysWhereItWas) {
  begin({0, 0, 0});
  EXPECT_TRUE(threaten({0.3, 0, 0}, {0, 0, -0.01}, 1.0, true).situation.look_at_m.isZero(1e-9)) << "held";
  const Eigen::Vector3d at_m = threaten({0.3, 0, 0}, {0, 0, -0.01}, 3.0).situation.look_at_m;
  viewer_.follow({});
  EXPECT_TRUE(step(0.5).situation.look_at_m.isApprox(at_m)) << "the percept has it no more";
  clear(1);
  EXPECT_TRUE(threaten({0.9, 0, 0}, {0, 0, -0.01}, 1.0).situation.look_at_m.isApprox(at_m)) << "over";
}

TEST_F(FollowedThreat, AThreatWithoutADirectionKeepsTheLastOne) {
  begin({0, 0, 0});
  EXPECT_TRUE(threaten({0.3, 0, 0}, {0, 0, 0}, 1.0).situation.pgv.isApprox(Eigen::Vector3d(0, 0, -0.01)));
  const HitView opposite = threaten({0.3, 0, 0}, {0, 0, 0.01}, 3.0);
  EXPECT_TRUE(opposite.situation.pgv.allFinite());
  EXPECT_GT(opposite.situation.pgv.z(), 0.0);
}

TEST_F(HitViews, NothingIsShownWithoutAnAlert) { EXPECT_EQ(step(0.1).alert, 0U); }

TEST_F(HitViews, AnAlertIsShownInTheNextFrameFromItsLookAtPoint) {
  raise(3);
  const HitView view = step(0.1);
  EXPECT_EQ(view.alert, 3U);
  EXPECT_TRUE(view.threatening);
  EXPECT_NEAR(view.situation.look_at_m.x(), 0.3, 1e-12);
  EXPECT_NEAR((view.eye_m - view.situation.look_at_m).norm(), ViewChoiceConfig{}.distance_m, 1e-12);
}

TEST_F(HitViews, AClearedAlertStaysInViewForItsHoldTime) {
  raise(1);
  step(0.1);
  clear(1);
  EXPECT_FALSE(step(0.1).threatening);
  EXPECT_EQ(step(2.8).alert, 1U);
  EXPECT_EQ(step(0.2).alert, 0U);
}

TEST_F(HitViews, ANewerAlertWaitsForTheLeastShowTime) {
  raise(1);
  step(0.1);
  raise(2);
  EXPECT_EQ(step(0.5).alert, 1U);
  EXPECT_EQ(step(0.6).alert, 2U);
}

TEST_F(HitViews, ANewerAlertTakesAViewThatIsOverAtOnce) {
  raise(1);
  step(0.1);
  clear(1);
  raise(2);
  EXPECT_EQ(step(0.1).alert, 2U);
}

TEST_F(HitViews, ARestartedPhantomsFirstAlertIsNewerThanOldNumbers) {
  raise(70);
  step(0.1);
  clear(70);
  raise(1);
  EXPECT_EQ(step(0.1).alert, 1U);
}

TEST_F(HitViews, HoldKeepsTheView) {
  raise(1);
  step(0.1);
  raise(2);
  clear(1);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(step(0.5, true).alert, 1U);
  EXPECT_EQ(step(0.1).alert, 2U);
}

TEST_F(HitViews, AnAlertThatIsOverBeforeItsTurnIsNotShown) {
  raise(1);
  step(0.1);
  raise(2);
  clear(2);
  EXPECT_EQ(step(2.0).alert, 1U);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
