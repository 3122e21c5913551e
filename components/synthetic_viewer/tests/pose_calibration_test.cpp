#include "components/synthetic_viewer/scene/pose_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "common/geometry/implicit/primitives.hpp"
#include "components/synthetic_viewer/scene/tests/picks_of_a_page.hpp"
#include "components/synthetic_viewer/tests/camera_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;
using Act = CalibrationRequest::Act;
namespace fs = std::filesystem;

class PoseByPicks : public ::testing::Test {
 protected:
  PoseByPicks() {
    fs::create_directories(folder_);
    camera_.calibration_file = folder_ / "gate_calibration.yaml";
    X_WS_ = *camera_.calibration.X_WC *
            geometry::Pose{geometry::rotation_from_rpy(0.02, -0.015, 0.01), {0.03, -0.02, 0.04}};
    pose_calibration_.show(corners_, {});
  }
  ~PoseByPicks() override { fs::remove_all(folder_); }
  /// Picks of so many corners, as the real camera sees them, each up to `off_px` beside.
  CalibrationRequest picks(std::size_t count, double off_px = 0.0) {
    CalibrationRequest request;
    std::uniform_real_distribution<double> off(-off_px, off_px);
    for (std::size_t i = 0; request.picks.size() < count && i < corners_.size(); ++i) {
      // From both plates in turn.
      const KnownCorner& corner = corners_[(i % 2) * corners_.size() / 2 + i / 2];
      const Eigen::Vector2d at = test::share_at(camera_, kWidth, kHeight, X_WS_, corner.position_W_m);
      if (at.minCoeff() < 0 || at.maxCoeff() > 1) continue;
      request.picks.push_back({corner.name, at.x() + off(random_) / kWidth, at.y() + off(random_) / kHeight});
    }
    return request;
  }
  std::string refusal(const CalibrationRequest& request) {
    const auto done = pose_calibration_.carry_out(request);
    return done ? "done: " + *done : done.status().message();
  }
  double off_m() {
    bool on_trial = false;
    return (pose_calibration_.in_force(on_trial).X_WC->translation_m - X_WS_.translation_m).norm();
  }
  bool on_trial() {
    bool on_trial = false;
    pose_calibration_.in_force(on_trial);
    return on_trial;
  }
  nlohmann::json told() { return nlohmann::json::parse(pose_calibration_.state_json(1)); }

  static constexpr int kWidth = 960, kHeight = 720;
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("pose_calibration_" + std::to_string(getpid()));
  VideoCamera camera_ = test::bent_camera();
  const runtime::CellConfig cell_ =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml");
  const std::vector<KnownCorner> corners_ = test::corners_of(cell_);
  geometry::Pose X_WS_;
  PoseCalibration pose_calibration_{camera_, kWidth, kHeight};
  std::mt19937 random_{3};
};

TEST_F(PoseByPicks, ExactPicksGiveTheExactPoseAndThoseOfAHandOneAsGoodAsIsTold) {
  ASSERT_GE(corners_.size(), 16U) << "eight of each plate";
  ASSERT_GT(off_m(), 0.05);
  ASSERT_TRUE(pose_calibration_.carry_out(picks(6)));
  EXPECT_LT(off_m(), 1e-4);
  EXPECT_TRUE(on_trial());
  EXPECT_LT(told()["pose"]["residual_px"].get<double>(), 0.01);
  EXPECT_NEAR(told()["moved_mm"].get<double>(), 53.9, 0.2);
  for (int k = 0; k < 20; ++k) {
    const auto done = pose_calibration_.carry_out(picks(8, 1.5));
    ASSERT_TRUE(done) << done.status().message();
    EXPECT_LT(1e3 * off_m(), 4 * told()["pose"]["sigma_mm"].get<double>() + 1.0);
    EXPECT_GT(told()["worst_px"].get<double>(), 0.0);
  }
}

TEST_F(PoseByPicks, ThreePicksAreEnoughAndTheCornersFollowThePoseThatIsFound) {
  ASSERT_TRUE(pose_calibration_.carry_out(picks(3)));
  EXPECT_LT(off_m(), 1e-3);
  EXPECT_EQ(told()["points"], 3);
  std::size_t seen = 0;
  const nlohmann::json state = told();
  for (const auto& corner : state["corners"]) {
    const auto known = std::ranges::find(corners_, corner["name"].get<std::string>(), &KnownCorner::name);
    const Eigen::Vector2d at = test::share_at(camera_, kWidth, kHeight, X_WS_, known->position_W_m);
    EXPECT_NEAR(corner["at"][0].get<double>(), at.x(), 2e-3);
    EXPECT_NEAR(corner["at"][1].get<double>(), at.y(), 2e-3);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(corner["place_m"][static_cast<std::size_t>(axis)].get<double>(), known->position_W_m[axis]);
    ++seen;
  }
  EXPECT_GE(seen, 4U);
}

// Tries synthetic_viewer: picks that determine no pose
TEST_F(PoseByPicks, BadPicksAreRefusedInOneSentenceAndChangeNothing) {
  const double before_m = off_m();
  EXPECT_EQ(refusal(picks(0)), "a pose needs three points, there are 0");
  EXPECT_EQ(refusal(picks(2)), "a pose needs three points, there are 2");
  CalibrationRequest request = picks(4);
  request.picks[2].corner = "pump:+++";
  EXPECT_EQ(refusal(request), "pick 3: no corner 'pump:+++' is known; allowed: those of the list");
  request = picks(4);
  request.picks[3].corner = request.picks[1].corner;
  EXPECT_THAT(refusal(request), HasSubstr("was picked already, as pick 2"));
  request = picks(4);
  request.picks[3].u = request.picks[0].u, request.picks[3].v = request.picks[0].v;
  EXPECT_EQ(refusal(request), "pick 4: is at the place of pick 1");
  request = picks(6);
  std::swap(request.picks[0].corner, request.picks[1].corner);
  EXPECT_THAT(refusal(request), HasSubstr("A point was picked wrongly"));
  // Three in line, and one that no camera there can see.
  std::vector<KnownCorner> others = corners_;
  for (int k = 0; k < 3; ++k) others.push_back({"line:" + std::to_string(k), {0.2 + 0.1 * k, 0.0, 1.0}});
  others.push_back({"behind:+++", X_WS_ * Eigen::Vector3d(0.1, 0.2, -1.0)});
  pose_calibration_.show(others, {});
  request.picks = {{"line:0", 0.1, 0.1}, {"line:1", 0.2, 0.2}, {"line:2", 0.3, 0.3}};
  EXPECT_THAT(refusal(request), HasSubstr("in line"));
  request = picks(5);
  request.picks.push_back({"behind:+++", 0.5, 0.5});
  EXPECT_THAT(refusal(request), ::testing::StartsWith("the points do not fit"));
  const nlohmann::json state = told();
  for (const auto& corner : state["corners"]) EXPECT_NE(corner["name"], "behind:+++");
  EXPECT_GT(state["corners"].size(), 8U);
  EXPECT_EQ(off_m(), before_m);
  EXPECT_FALSE(on_trial());
  EXPECT_THAT(refusal({Act::kKeep, {}}), HasSubstr("no pose is on trial"));
  EXPECT_THAT(refusal({Act::kDiscard, {}}), HasSubstr("no pose is on trial"));
  EXPECT_FALSE(fs::exists(camera_.calibration_file));
}

TEST_F(PoseByPicks, WhatIsKeptIsTheFileOfCalibrateAndWhatIsDiscardedIsGone) {
  const double before_m = off_m();
  ASSERT_TRUE(pose_calibration_.carry_out(picks(6, 0.5)));
  EXPECT_THAT(refusal({Act::kKeep, {}, 2}), HasSubstr("another pose is on trial by now"));
  EXPECT_THAT(refusal({Act::kDiscard, {}, 2}), HasSubstr("another pose is on trial by now"));
  ASSERT_TRUE(pose_calibration_.carry_out({Act::kDiscard, {}, 1}));
  EXPECT_EQ(off_m(), before_m);
  ASSERT_TRUE(pose_calibration_.carry_out(picks(6, 0.5)));
  EXPECT_EQ(told()["trial"], 2);
  EXPECT_THAT(refusal({Act::kKeep, {}, 1}), HasSubstr("another pose is on trial by now")) << "another page's";
  EXPECT_FALSE(fs::exists(camera_.calibration_file));
  EXPECT_THAT(refusal({Act::kKeep, {}, 2}), HasSubstr("done: written: " + camera_.calibration_file.string() +
                                                      "; it holds after a restart once"));
  EXPECT_FALSE(on_trial());
  const Calibration written = load_calibration(camera_.calibration_file);
  EXPECT_LT((written.X_WC->translation_m - X_WS_.translation_m).norm(), 0.02);
  EXPECT_EQ(*written.lens, *camera_.calibration.lens);
  EXPECT_GT(written.pose_residual_px, 0.0);
  EXPECT_GT(written.pose_sigma_mm, 0.0);
  bool on_trial = true;
  EXPECT_LT((pose_calibration_.in_force(on_trial).X_WC->translation_m - written.X_WC->translation_m).norm(),
            1e-6);
}

// Tries synthetic_viewer: a calibration that cannot be written
TEST_F(PoseByPicks, WhatCannotBeWrittenStaysOnTrial) {
  ASSERT_TRUE(pose_calibration_.carry_out(picks(6, 0.5)));
  fs::create_directories(camera_.calibration_file);  // a folder stands in its place
  EXPECT_THAT(refusal({Act::kKeep, {}, 1}), HasSubstr("cannot be written"));
  EXPECT_TRUE(on_trial());
  EXPECT_LT(off_m(), 0.02);
}

TEST_F(PoseByPicks, CornersThatABodyHidesAreNotOffered) {
  const std::size_t all = told()["corners"].size();
  RayScene wall;
  const geometry::Pose X_WC = *camera_.calibration.X_WC;
  wall.bodies.push_back({std::make_shared<const RayMesh>(geometry::make_box({4, 4, 0.02})),
                         X_WC * geometry::Pose{Eigen::Matrix3d::Identity(), {0, 0, 0.2}},
                         {}});
  pose_calibration_.show(corners_, wall);
  EXPECT_GT(all, 8U);
  EXPECT_EQ(told()["corners"].size(), 0U);
  EXPECT_TRUE(pose_calibration_.carry_out(picks(6))) << "but they are known";
}

TEST(KnownCorners, TheShippedCellOffersMoreThanAPoseNeedsAndEachNameOnce) {
  const std::vector<KnownCorner> corners =
      test::corners_of(runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml"));
  std::set<std::string> names, objects;
  for (const KnownCorner& corner : corners) {
    names.insert(corner.name);
    objects.insert(corner.name.substr(0, corner.name.rfind(':')));
  }
  EXPECT_EQ(names.size(), corners.size());
  EXPECT_GE(objects.size(), 8U);
  EXPECT_TRUE(names.contains("work_table:---"));
}

// Tries synthetic_viewer: picks that determine no pose
TEST(RequestOfThePage, IsWholeOrRefused) {
  const auto refusal = [](const std::string& text) {
    const auto parsed = parse_calibration_request(text);
    return parsed ? "" : parsed.status().message();
  };
  EXPECT_EQ(refusal(R"({"keep": 1})"), "");
  EXPECT_EQ(refusal(R"({"try": [{"corner": "a:+-+", "at": [0, 1]}]})"), "");
  for (const char* text : {"", "{}", "[]", "7", R"({"keep": true})", R"({"discard": -1})", R"({"keep": 1.5})",
                           R"({"try": {}})", R"({"keep": 1, "discard": 1})", R"({"steal": true})"})
    EXPECT_THAT(refusal(text), HasSubstr("a JSON object {\"try\"")) << text;
  const auto pick = [&](const std::string& at) {
    return refusal(R"({"try": [{"corner": "a:+-+", "at": )" + at + "}]}");
  };
  for (const char* at : {"[0.5, 1.01]", "[-0.01, 0]", "[0.5]", "[0, 0, 0]", "[null, 0]", "[\"0\", 0]", "3"})
    EXPECT_THAT(pick(at), HasSubstr("pick 1: lies outside the picture; allowed")) << at;
  EXPECT_THAT(pick("[1e999, 0]"), HasSubstr("a JSON object")) << "no number of JSON";
  EXPECT_THAT(refusal(R"({"try": [7]})"), HasSubstr("pick 1: a JSON object"));
  EXPECT_THAT(refusal(R"({"try": [{"corner": 7, "at": [0, 0]}]})"), HasSubstr("name of a known corner"));
  std::string many = R"({"try": [)";
  for (int k = 0; k < 33; ++k) many += std::string(k ? "," : "") + R"({"corner": "a", "at": [0, 0]})";
  EXPECT_THAT(refusal(many + "]}"), HasSubstr("there are 33 picks; allowed: 3 to 32"));
  std::mt19937 random(1);
  const std::string whole = R"({"try": [{"corner": "a:+-+", "at": [0.25, 0.75]}]})";
  for (int k = 0; k < 2000; ++k) {
    std::string text = whole.substr(0, random() % (whole.size() + 1));
    for (int n = 0; n < 2 && !text.empty(); ++n) text[random() % text.size()] = static_cast<char>(random());
    const auto parsed = parse_calibration_request(text);
    if (!parsed) continue;
    for (const auto& one : parsed->picks) EXPECT_TRUE(one.u >= 0 && one.u <= 1 && one.v >= 0 && one.v <= 1);
  }
}

}  // namespace
}  // namespace phantom::synthetic_viewer
