#include "components/synthetic_viewer/report_pictures.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

class PicturesOfAReport : public test::DrawnCell {
 protected:
  PicturesOfAReport() { state_.arm = pose(); }
  bool round(bool complete, const GiveUp& give_up = {}) {
    advance();
    return pictures_.photograph(drawing_, state_.arm, complete, give_up);
  }
  nlohmann::json finished() {
    report_.finish({});
    return nlohmann::json::parse(std::ifstream(folder_ / "synthetic_viewer.json"));
  }
  Report report_{folder_, 2};
  ReportPictures pictures_{report_, now_ns_};
};

TEST_F(PicturesOfAReport, EachMilestoneIsTakenOnceWhenItIsReached) {
  EXPECT_TRUE(round(false));
  EXPECT_TRUE(round(true));
  EXPECT_TRUE(round(true));
  state_.arm.contact = true;
  EXPECT_TRUE(round(true));
  raise(alert(1, {0.6, 0.1, 1.2}));
  EXPECT_TRUE(round(true));
  EXPECT_TRUE(round(true));
  pictures_.finish(drawing_);
  const std::vector<std::string> taken = finished().at("pictures");
  EXPECT_EQ(taken, (std::vector<std::string>{"main_start.png", "main_first_contact.png", "main_first_hit.png",
                                             "main.png"}));
  for (const std::string& name : taken) EXPECT_GT(std::filesystem::file_size(folder_ / name), 0u) << name;
}

TEST_F(PicturesOfAReport, WhatIsGivenUpIsTakenLater) {
  EXPECT_FALSE(round(true, [] { return true; }));
  pictures_.take(alert(1, {0.6, 0.1, 1.2}));
  EXPECT_FALSE(round(true, [] { return true; }));
  EXPECT_TRUE(round(true));
  const nlohmann::json report = finished();
  EXPECT_EQ(report.at("pictures"), nlohmann::json({"main_start.png"}));
  EXPECT_EQ(report.at("views").size(), 1u);
}

TEST_F(PicturesOfAReport, OneAlertARoundTheRestAtTheEndAndNoMoreThanAreWanted) {
  for (std::uint32_t number = 1; number <= 2; ++number) {
    HitSample hit = alert(number, {0.6, 0.1 * number, 1.2});
    hit.received_ns = now_ns_ + number * core::kNsPerSecond;
    pictures_.take(hit);
  }
  EXPECT_TRUE(round(false));
  EXPECT_TRUE(report_.wants_hit_pictures());
  pictures_.finish(drawing_);
  EXPECT_FALSE(report_.wants_hit_pictures());
  pictures_.take(alert(3, {0.6, 0.1, 1.2}));
  EXPECT_TRUE(round(false));
  const nlohmann::json views = finished().at("views");
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].at("alert"), 1);
  EXPECT_EQ(views[1].at("alert"), 2);
  EXPECT_NEAR(views[0].at("t").get<double>(), 1.0, 1e-6) << "since the report's beginning";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
