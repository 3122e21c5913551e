#include "components/synthetic_viewer/output/publisher.hpp"

#include <gtest/gtest.h>

#include <future>

#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

class PublisherOfACell : public test::DrawnCell {
 protected:
  PublisherOfACell() { state_.arm = pose(); }
  bool has_picture(std::uint32_t alert) { return !content_.hit_picture(alert).empty(); }
  Publisher publisher_{config_, config_, content_};
};

TEST_F(PublisherOfACell, DrawsOnlyWhatSomebodyFollows) {
  advance();
  EXPECT_TRUE(publisher_.show_views(drawing_, true, {}));
  for (const View view : kViews) EXPECT_FALSE(content_.view(view).image.newest()) << name_of(view);
  content_.view(View::kTool).image.followers = 1;
  EXPECT_TRUE(publisher_.show_views(drawing_, false, {}));
  EXPECT_FALSE(content_.view(View::kTool).image.newest()) << "nobody knows where the arm is";
  EXPECT_TRUE(publisher_.show_views(drawing_, true, {}));
  EXPECT_TRUE(content_.view(View::kTool).image.newest());
  EXPECT_FALSE(content_.view(View::kMain).image.newest());
}

TEST_F(PublisherOfACell, AViewThatIsGivenUpIsHandedOutInALaterRound) {
  content_.view(View::kMain).jpeg.followers = 1;
  advance();
  EXPECT_FALSE(publisher_.show_views(drawing_, true, [] { return true; }));
  EXPECT_FALSE(content_.view(View::kMain).jpeg.newest());
  EXPECT_TRUE(publisher_.show_views(drawing_, true, {}));
  EXPECT_TRUE(content_.view(View::kMain).jpeg.newest());
}

TEST_F(PublisherOfACell, EveryAlertGetsItsFirstPictureButNotAllInOneRound) {
  for (std::uint32_t number = 1; number <= 5; ++number)
    publisher_.take(alert(number, {0.6, 0.1 * number, 1.2}));
  advance();
  publisher_.show_threats(drawing_);
  EXPECT_TRUE(has_picture(1) && has_picture(2) && has_picture(3));
  EXPECT_FALSE(has_picture(4) || has_picture(5));
  publisher_.show_threats(drawing_);
  EXPECT_TRUE(has_picture(4) && has_picture(5));
  EXPECT_FALSE(has_picture(6));
  EXPECT_EQ(publisher_.alert_to_picture().count(), 5u);
  EXPECT_GT(publisher_.last_alert_to_picture_ns(), 0);
}

TEST_F(PublisherOfACell, OfAFloodOfAlertsTheOldestAreLeftOut) {
  for (std::uint32_t number = 1; number <= ViewerState::kMaxHits + 2; ++number)
    publisher_.take(alert(number, {0.6, 0.1, 1.2}));
  advance();
  publisher_.show_threats(drawing_);
  EXPECT_FALSE(has_picture(1) || has_picture(2));
  EXPECT_TRUE(has_picture(3));
}

TEST_F(PublisherOfACell, TheHitZonesViewEndsWithTheThreat) {
  content_.view(View::kHit).image.followers = 1;
  HitSample hit = alert(1, {0.6, 0.1, 1.2});
  raise(hit);
  advance();
  publisher_.show_threats(drawing_);
  EXPECT_TRUE(content_.view(View::kHit).image.newest());
  hit.cleared = true;
  raise(hit);
  advance(config_.hit_view.rule.hold_after_clear_s + 1);
  publisher_.show_threats(drawing_);
  EXPECT_FALSE(content_.view(View::kHit).image.newest());
}

TEST_F(PublisherOfACell, ASnapshotIsDrawnForTheOneWhoAsksAndNobodyWaitsPastTheEnd) {
  auto asked = std::async(std::launch::async, [this] { return content_.main_png(); });
  while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
    advance();
    publisher_.show_views(drawing_, true, {});
  }
  const std::string png = asked.get();
  EXPECT_EQ(png.substr(1, 3), "PNG");
  publisher_.end();
  EXPECT_EQ(content_.main_png(), png) << "the last one, at once";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
