#include "components/synthetic_viewer/drawing.hpp"

#include <gtest/gtest.h>

#include "common/geometry/primitives.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"
#include "components/synthetic_viewer/tests/mesh_chunks.hpp"

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
