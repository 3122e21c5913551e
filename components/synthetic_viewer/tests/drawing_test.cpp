#include "components/synthetic_viewer/scene/drawing.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/living.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

class DrawingOfACell : public test::DrawnCell {};

TEST_F(DrawingOfACell, AnAlertsZoneIsShownWithTheArmAsItWasWhenTheAlertCame) {
  state_.chosen = static_cast<ViewNode>(11);
  HitSample hit = alert(9, {0.6, 0.1, 1.2});
  hit.arm = state_.arm = pose(0.3);
  advance();
  const Drawing::AlertPicture at_once = drawing_.picture(hit);
  EXPECT_EQ(at_once.node, state_.chosen);
  state_.arm = pose(-0.8);
  advance(3.0);
  EXPECT_TRUE(same_picture(drawing_.picture(hit).picture.frame, at_once.picture.frame));
  hit.arm = pose(0.5);
  EXPECT_FALSE(same_picture(drawing_.picture(hit).picture.frame, at_once.picture.frame));
}

TEST_F(DrawingOfACell, TellsWhenAnotherAlertsZoneIsShown) {
  state_.arm = pose();
  EXPECT_FALSE(drawing_.advance(now_ns_, 0.1));
  HitSample hit = alert(3, {0.6, 0.1, 1.2});
  drawing_.take(hit);
  EXPECT_TRUE(drawing_.advance(now_ns_, 0.1));
  EXPECT_EQ(drawing_.hit_view().alert, 3u);
  EXPECT_FALSE(drawing_.advance(now_ns_, 0.1)) << "still the same";
  hit.cleared = true;
  drawing_.take(hit);
  EXPECT_TRUE(drawing_.advance(now_ns_, config_.hit_view.rule.hold_after_clear_s)) << "over for long enough";
  EXPECT_EQ(drawing_.hit_view().alert, 0u);
}

// Tries synthetic_viewer: master silent while its views
TEST_F(DrawingOfACell, WithoutViewsAZoneIsShownOnlyWhileItIsHeld) {
  state_.arm = pose();
  const auto master = [&](bool views) {
    state_.master.received_ns = now_ns_;
    state_.master.views_enabled = views;
  };
  raise(alert(5, {0.6, 0.1, 1.2}));
  master(false);
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 0U);
  EXPECT_FALSE(drawing_.view_pose().hit_zone);
  EXPECT_EQ(state_.hits.size(), 1U) << "the alert is listed";
  state_.hold = true;
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 5U) << "asked for by hand";
  state_.hold = false;
  master(false);
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 0U);
  master(true);
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 5U) << "it threatens still";
  master(false);
  advance(config_.staleness.slave_s + 0.01);
  EXPECT_EQ(drawing_.hit_view().alert, 5U) << "no master is heard that would go without";
}

TEST_F(DrawingOfACell, AViewThatTheOperatorTurnedKeepsItsNodeAndStandsAtNone) {
  state_.arm = pose();
  drawing_.take(alert(1, {0.6, 0.1, 1.2}));
  advance();
  const ViewNode node = drawing_.hit_view().node;
  EXPECT_EQ(drawing_.view_pose().node, static_cast<int>(node));
  EXPECT_TRUE(drawing_.view_pose().automatic);
  state_.cameras.take({.view = View::kHit, .azimuth_rad = 0.4});
  for (int k = 0; k < 20; ++k) advance();
  EXPECT_EQ(drawing_.hit_view().node, node);
  EXPECT_EQ(drawing_.view_pose().node, 0);
  EXPECT_FALSE(drawing_.view_pose().automatic);
}

TEST_F(DrawingOfACell, LiveMatterIsDrawnByItsSurfaceOnceThatIsKnown) {
  const geometry::TriangleMesh marker = geometry::make_box({0.02, 0.02, 0.02});
  ASSERT_TRUE(drawing_.take(test::chunks_of(marker, 1 << 17).front()));
  geometry::Pose middle;
  middle.translation_m = {0.3, 0.1, 0.4};
  state_.take(
      ObjectSample{messages::kLiveId, messages::kLiveName, marker.content_hash(), middle, {1.0F, 0.3F, 0.0F}},
      now_ns_);
  const auto drawn = [&] {
    advance();
    return drawing_.picture(View::kMain).frame.items.front();
  };
  const auto obstacle_m = [&] {
    const auto& bodies = drawing_.bodies().bodies;
    const auto live = std::ranges::find_if(
        bodies, [](const RayScene::Body& body) { return body.name.object == messages::kLiveId; });
    return live == bodies.end() ? Eigen::Vector3d(-1, -1, -1) : live->X_WM.translation_m;
  };
  const DrawItem small = drawn();
  EXPECT_EQ(obstacle_m(), middle.translation_m);
  drawing_.show_live({{messages::kLiveId, geometry::make_box({0.4, 0.3, 0.2})}});
  const DrawItem shown = drawn();
  EXPECT_NE(shown.mesh, small.mesh);
  EXPECT_EQ(shown.colour, small.colour);
  EXPECT_TRUE(shown.W_from_mesh.isIdentity()) << "its surface is in W";
  EXPECT_EQ(obstacle_m(), Eigen::Vector3d::Zero()) << "views look past it";
  drawing_.show_live({});
  EXPECT_EQ(drawn().mesh, small.mesh);
}

TEST_F(DrawingOfACell, TheWayFromTheToolToAnObjectIsShownWhereNoAlertIs) {
  state_.arm = pose();
  robot::LinkPoses X_WL;
  arm_.link_poses(state_.arm.position, X_WL);
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.1, 0.04});
  ASSERT_TRUE(drawing_.take(test::chunks_of(box, 1 << 17).front()));
  geometry::Pose beside = X_WL[arm_.joint_count()];
  beside.translation_m.z() += 0.4;
  state_.take(ObjectSample{5, "block", box.content_hash(), beside, {0.5F, 0.5F, 0.5F}}, now_ns_);
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 0U);
  state_.approach = true;
  advance();
  const HitView& view = drawing_.hit_view();
  ASSERT_TRUE(view.approach);
  EXPECT_EQ(view.approach->object, 5);
  EXPECT_GT(view.approach->gap_m, 0.0);
  EXPECT_LT(view.approach->gap_m, 0.4);
  const Compositor::Picture picture = drawing_.picture(View::kHit);
  EXPECT_NE(picture.hud.subtitle.find("block: gap "), std::string::npos) << picture.hud.subtitle;
  EXPECT_FALSE(picture.hud.alarm);
  raise(alert(4, {0.6, 0.1, 1.2}));
  advance();
  EXPECT_EQ(drawing_.hit_view().alert, 4U) << "an alert comes first";
}

// Tries synthetic_viewer: a damaged mesh
TEST_F(DrawingOfACell, TakesAMeshOnceAndRefusesADamagedOne) {
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.2, 0.3});
  auto damaged = test::chunks_of(box, 1 << 17);
  damaged.front().data.back() ^= 1U;
  EXPECT_FALSE(drawing_.take(damaged.front()));
  EXPECT_TRUE(drawing_.scene().meshes.empty());
  const auto whole = test::chunks_of(box, 1 << 17);
  EXPECT_TRUE(drawing_.take(whole.front()));
  ASSERT_EQ(drawing_.scene().meshes.size(), 1u);
  const MeshHandle handle = drawing_.scene().meshes.begin()->second.picture;
  EXPECT_TRUE(drawing_.take(whole.front()));
  EXPECT_EQ(drawing_.scene().meshes.begin()->second.picture, handle);
}

TEST_F(DrawingOfACell, AMeshIsDroppedAWhileAfterItsLastObjectWasRemoved) {
  constexpr core::Nanoseconds kKept = Drawing::kKeepUnnamed_ns, kSecond = core::kNsPerSecond;
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.2, 0.3});
  const auto chunk = test::chunks_of(box, 1 << 17).front();
  const auto has = [&] { return drawing_.scene().meshes.contains(box.content_hash()); };
  ASSERT_TRUE(drawing_.take(chunk));
  drawing_.drop_meshes_of_removed_objects(kSecond);
  drawing_.drop_meshes_of_removed_objects(kSecond + 2 * kKept);
  EXPECT_TRUE(has()) << "its object is still to come";
  const core::Nanoseconds named_ns = 2 * kKept + 2 * kSecond;
  state_.take(ObjectSample{1, "box", box.content_hash(), {}, {0.5F, 0.5F, 0.5F}}, now_ns_);
  drawing_.drop_meshes_of_removed_objects(named_ns);
  state_.objects.erase(1);
  drawing_.drop_meshes_of_removed_objects(named_ns + kSecond);
  drawing_.drop_meshes_of_removed_objects(named_ns + kSecond + kKept);
  EXPECT_TRUE(has()) << "not at once";
  EXPECT_TRUE(drawing_.take(chunk)) << "it is sent again: an object is about to have it";
  drawing_.drop_meshes_of_removed_objects(named_ns + 2 * kSecond + kKept);
  EXPECT_TRUE(has());
  drawing_.drop_meshes_of_removed_objects(named_ns + 3 * kSecond + 2 * kKept);
  EXPECT_FALSE(has());
  EXPECT_EQ(drawing_.meshes_given_up(), 0u) << "nothing is missing";
  ASSERT_TRUE(drawing_.take(chunk));
  EXPECT_TRUE(has());
}

// Tries synthetic_viewer: more come than there is room for
TEST_F(DrawingOfACell, OfMoreMeshesThanThereIsRoomForThoseThatNoObjectNamesAreGivenUpOldestFirst) {
  Drawing small{config_, cell_, arm_, load_arm_meshes(arm_, runtime::load_skin(cell_.arm(), arm_)),
                state_,  36};  // three boxes
  std::vector<std::uint64_t> hashes;
  const auto take_box = [&](double size_m) {
    const geometry::TriangleMesh box = geometry::make_box({0.1, 0.2, size_m});
    hashes.push_back(box.content_hash());
    return small.take(test::chunks_of(box, 1 << 17).front());
  };
  const auto name = [&](std::uint16_t id) {
    state_.take(ObjectSample{id, "box", hashes[id], {}, {0.5F, 0.5F, 0.5F}}, now_ns_);
  };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(take_box(0.3 + 0.1 * i));
  name(0);
  EXPECT_TRUE(take_box(0.9));
  EXPECT_TRUE(small.scene().meshes.contains(hashes[0])) << "an object has it";
  EXPECT_FALSE(small.scene().meshes.contains(hashes[1])) << "the oldest of the others";
  EXPECT_TRUE(small.scene().meshes.contains(hashes[2]));
  EXPECT_EQ(small.meshes_given_up(), 1u);
  name(2), name(3);
  const core::Status refused = take_box(1.0);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.message().find("too many triangles; allowed: 36"), std::string::npos);
  EXPECT_EQ(small.scene().meshes.size(), 3u);
}

TEST_F(DrawingOfACell, ThePaintCountsAsChangedOnlyIfItIs) {
  SkinSample skin;
  skin.valid = true;
  skin.patch_m = 0.02;
  skin.felt = {{2, {0.0F, 0.0F, 0.1F}, 0.5F}};
  const std::uint64_t before = drawing_.scene().paint_number;
  drawing_.paint(skin);
  EXPECT_EQ(drawing_.scene().paint_number, before + 1);
  state_.skin = skin;
  drawing_.paint(skin);
  EXPECT_EQ(drawing_.scene().paint_number, before + 1);
  skin.felt.front().closeness = 0.6F;
  drawing_.paint(skin);
  EXPECT_EQ(drawing_.scene().paint_number, before + 2);
}

TEST_F(DrawingOfACell, APictureForTheReportIsGivenUpForWhatIsMoreUrgent) {
  advance();
  EXPECT_FALSE(drawing_.report_picture(drawing_.picture(View::kMain), [] { return true; }));
  EXPECT_TRUE(drawing_.report_picture(drawing_.picture(View::kMain), {}));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
