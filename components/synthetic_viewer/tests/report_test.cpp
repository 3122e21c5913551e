#include "components/synthetic_viewer/output/report.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

class PicturesOfAReport : public test::DrawnCell {
 protected:
  PicturesOfAReport() { state_.arm = pose(); }
  bool round(bool complete, const CancelCheck& give_up = {}) {
    advance();
    return report_.make_pictures(drawing_, state_.arm, complete, give_up);
  }
  nlohmann::json finished() {
    report_.finish(nlohmann::json::object());
    return nlohmann::json::parse(std::ifstream(folder_ / "synthetic_viewer.json"));
  }
  Report report_{folder_, 2, now_ns_};
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
  report_.make_remaining_pictures(drawing_);
  const std::vector<std::string> taken = finished().at("pictures");
  EXPECT_EQ(taken, (std::vector<std::string>{"main_start.png", "main_first_contact.png", "main_first_hit.png",
                                             "main.png"}));
  for (const std::string& name : taken) EXPECT_GT(std::filesystem::file_size(folder_ / name), 0u) << name;
}

TEST_F(PicturesOfAReport, WhatIsGivenUpIsTakenLater) {
  EXPECT_FALSE(round(true, [] { return true; }));
  report_.take(alert(1, {0.6, 0.1, 1.2}));
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
    report_.take(hit);
  }
  EXPECT_TRUE(round(false));
  EXPECT_TRUE(report_.wants_hit_pictures());
  report_.make_remaining_pictures(drawing_);
  EXPECT_FALSE(report_.wants_hit_pictures());
  report_.take(alert(3, {0.6, 0.1, 1.2}));
  EXPECT_TRUE(round(false));
  const nlohmann::json views = finished().at("views");
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].at("alert"), 1);
  EXPECT_EQ(views[1].at("alert"), 2);
  EXPECT_NEAR(views[0].at("t").get<double>(), 1.0, 1e-6) << "since the report's beginning";
}

TEST_F(PicturesOfAReport, LeavesPicturesAndFigures) {
  report_.take(alert(6, {0.6, 0.1, 1.2}));
  EXPECT_TRUE(round(false));
  ASSERT_TRUE(report_.wants_hit_pictures());
  report_.take(alert(7, {0.6, 0.2, 1.2}));
  EXPECT_TRUE(round(false));
  EXPECT_FALSE(report_.wants_hit_pictures());
  report_.make_remaining_pictures(drawing_);
  report_.finish({{"frames", 30}, {"page", "http://127.0.0.1:8080/"}});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "main.png"));
  const auto json = nlohmann::json::parse(std::ifstream(folder_ / "synthetic_viewer.json"));
  EXPECT_EQ(json.at("frames"), 30);
  EXPECT_EQ(json.at("page"), "http://127.0.0.1:8080/");
  const auto& view = json.at("views")[1];
  const std::string node = view.at("node");
  EXPECT_TRUE(percept::node_from_name(node)) << node;
  EXPECT_EQ(view.at("png"), "hit_002_" + node + ".png");
  EXPECT_TRUE(std::filesystem::exists(folder_ / view.at("png")));
  EXPECT_EQ(view.at("alert"), 7);
}

TEST_F(PicturesOfAReport, DoesNothingWithoutAFolder) {
  Report report({}, 10, now_ns_);
  EXPECT_FALSE(report.wants_hit_pictures());
  EXPECT_TRUE(report.make_pictures(drawing_, state_.arm, true, [] { return true; }));
  report.finish({});
}

}  // namespace
}  // namespace phantom::synthetic_viewer
