#include "components/workspace_camera/pose_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>

#include "components/workspace_camera/confirmed_findings.hpp"
#include "components/workspace_camera/depth_raster.hpp"
#include "components/workspace_camera/pose_checker.hpp"
#include "components/workspace_camera/service.hpp"
#include "components/workspace_camera/tests/rig.hpp"

namespace phantom::workspace_camera::pose_check_test {
namespace {

using namespace rig;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

geometry::Pose at(const Eigen::Vector3d& p_m, double turn_rad = 0.0) {
  return {geometry::rotation_about(Eigen::Vector3d::UnitZ(), turn_rad), p_m};
}

/// A box and a drum on a table before a wall, as the model has them.
struct Model {
  std::vector<ModelObject> objects{{1, "table", geometry::make_box({0.9, 0.6, 0.04})},
                                   {2, "box", geometry::make_box({0.16, 0.12, 0.2})},
                                   {3, "drum", geometry::make_cylinder(0.09, 0.24)}};
  std::vector<std::optional<geometry::Pose>> X_WO{at({0.0, 0.0, 0.1}), at({-0.2, 0.0, 0.22}),
                                                  at({0.2, 0.05, 0.24})};
};

/// What a camera sees of the objects where they really stand; nothing: not there.
fusion::DepthImage image_of(const Model& model, const std::vector<std::optional<geometry::Pose>>& real_WO,
                            std::uint64_t seed, std::vector<geometry::TriangleMesh> others = {}) {
  for (std::size_t i = 0; i < model.objects.size(); ++i)
    if (real_WO[i]) others.push_back(model.objects[i].mesh_O.transformed(*real_WO[i]));
  const fusion::CameraScene cell = scene(std::move(others));
  CameraConfig camera = config().cameras[0];
  camera.simulated.seed = seed;
  SimulatedCamera eye(camera.simulated, camera.X_FC, cell, {});
  fusion::DepthImage image;
  const core::Status loaded =
      image.load_mm({eye.camera(), camera.X_FC, 1.0}, eye.image(0.0, nullptr, nullptr));
  EXPECT_TRUE(loaded) << loaded.message();
  return image;
}

std::vector<PoseFinding> judge(const std::vector<std::optional<geometry::Pose>>& real_WO,
                               std::uint64_t seed = 1, std::vector<geometry::TriangleMesh> others = {}) {
  const Model model;
  PoseCheck check({}, model.objects);
  const fusion::DepthImage image = image_of(model, real_WO, seed, std::move(others));
  return check.judge(image, {}, model.X_WO);
}

PoseFinding of(const std::vector<PoseFinding>& findings, std::uint16_t id) {
  const auto found = std::ranges::find(findings, id, &PoseFinding::id);
  return found == findings.end() ? PoseFinding{} : *found;
}

TEST(PoseCheck, AModelThatIsTrueAgreesWhateverTheNoise) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const PoseFinding& finding : judge(Model().X_WO, seed))
      EXPECT_EQ(finding.verdict, PoseVerdict::kAgrees)
          << finding.name << ": " << finding.agree << " of " << finding.pixels << ", seed " << seed;
}

TEST(PoseCheck, SR28_AnObjectThatStandsElsewhereIsFoundThereAndTheOthersAgree) {
  for (const Eigen::Vector3d& shift_m : {Eigen::Vector3d(0.10, 0.0, 0.0), Eigen::Vector3d(-0.08, -0.06, 0.0),
                                         Eigen::Vector3d(0.0, 0.09, 0.0)}) {
    auto real_WO = Model().X_WO;
    real_WO[2]->translation_m += shift_m;
    const auto findings = judge(real_WO);
    const PoseFinding drum = of(findings, 3);
    ASSERT_EQ(drum.verdict, PoseVerdict::kElsewhere) << shift_m.transpose();
    EXPECT_LT((drum.shift_m - shift_m).norm(), 0.012) << drum.shift_m.transpose();
    EXPECT_LT(drum.residual_m, 0.006);
    EXPECT_EQ(of(findings, 1).verdict, PoseVerdict::kAgrees);
    EXPECT_EQ(of(findings, 2).verdict, PoseVerdict::kAgrees);
  }
}

TEST(PoseCheck, WhatWasFoundIsKeptWhileImagesConfirmItAndFoundAgainOnceItMoves) {
  const Model model;
  PoseCheck check({}, model.objects);
  auto real_WO = model.X_WO;
  real_WO[2]->translation_m.x() += 0.1;
  const PoseFinding first = of(check.judge(image_of(model, real_WO, 1), {}, model.X_WO), 3);
  const PoseFinding second = of(check.judge(image_of(model, real_WO, 2), {}, model.X_WO), 3);
  ASSERT_EQ(second.verdict, PoseVerdict::kElsewhere);
  EXPECT_EQ(second.shift_m, first.shift_m) << "no fit was made";
  real_WO[2]->translation_m.x() -= 0.16;
  const PoseFinding third = of(check.judge(image_of(model, real_WO, 3), {}, model.X_WO), 3);
  ASSERT_EQ(third.verdict, PoseVerdict::kElsewhere);
  EXPECT_NEAR(third.shift_m.x(), -0.06, 0.012);
  EXPECT_EQ(of(check.judge(image_of(model, model.X_WO, 4), {}, model.X_WO), 3).verdict, PoseVerdict::kAgrees);
}

TEST(PoseCheck, ATurnedBoxIsFoundTurned) {
  auto real_WO = Model().X_WO;
  real_WO[1] = at({-0.16, -0.03, 0.22}, 0.2);
  const PoseFinding box = of(judge(real_WO), 2);
  ASSERT_EQ(box.verdict, PoseVerdict::kElsewhere);
  EXPECT_LT((box.shift_m - Eigen::Vector3d(0.04, -0.03, 0.0)).norm(), 0.012) << box.shift_m.transpose();
  EXPECT_NEAR(box.turned_rad, 0.2, 0.05);
}

TEST(PoseCheck, AnObjectThatWasTakenAwayIsGone) {
  auto real_WO = Model().X_WO;
  real_WO[1].reset();
  const auto findings = judge(real_WO);
  EXPECT_EQ(of(findings, 2).verdict, PoseVerdict::kGone);
  EXPECT_EQ(of(findings, 3).verdict, PoseVerdict::kAgrees);
}

TEST(PoseCheck, WhatSomethingElseHidesIsUnseen) {
  const auto hand = geometry::make_box({0.3, 0.02, 0.4}).transformed(at({-0.2, -0.4, 0.3}));
  const auto findings = judge(Model().X_WO, 1, {hand});
  EXPECT_EQ(of(findings, 2).verdict, PoseVerdict::kUnseen);
  EXPECT_EQ(of(findings, 3).verdict, PoseVerdict::kAgrees);
}

TEST(PoseCheck, TheArmIsNeitherTheObjectNorSeenThrough) {
  const Model model;
  PoseCheck check({}, model.objects);
  const auto rod = geometry::make_box({0.12, 0.1, 0.5}).transformed(at({-0.2, -0.3, 0.4}));
  const fusion::DepthImage image = image_of(model, model.X_WO, 1, {rod});
  std::vector<float> arm_depth_m(image.camera().pixels(), 0.0F);
  std::vector<Eigen::Vector3d> corners_m;
  draw_mesh(rod, image.X_WC().inverse(), image.camera(), corners_m,
            [&](std::size_t pixel, double depth_m, double) {
              float& at_m = arm_depth_m[pixel];
              if (at_m == 0.0F || depth_m < static_cast<double>(at_m)) at_m = static_cast<float>(depth_m);
            });
  const auto with = of(check.judge(image, arm_depth_m, model.X_WO), 2);
  const auto without = of(check.judge(image, {}, model.X_WO), 2);
  EXPECT_LT(with.pixels, without.pixels);
  EXPECT_EQ(with.agree, with.pixels) << "but for noise at edges nothing is hidden or seen through";
  EXPECT_LT(without.agree, without.pixels);
}

TEST(PoseCheck, AnObjectThatIsNotInTheWorkspaceIsNotJudged) {
  Model model;
  PoseCheck check({}, model.objects);
  const fusion::DepthImage image = image_of(model, model.X_WO, 1);
  model.X_WO[1].reset();
  const auto findings = check.judge(image, {}, model.X_WO);
  EXPECT_EQ(findings.size(), 2U);
  EXPECT_EQ(of(findings, 2).id, 0);
}

/// A wall fills the image: how far it is shows, how far it was slid does not.
TEST(PoseRefinement, LeavesADirectionAsItIsInWhichNoPixelTellsPosesApart) {
  const fusion::PinholeCamera camera{80, 60, 70.0, 70.0, 39.5, 29.5, 0.3, 4.0};
  const geometry::TriangleMesh wall = geometry::make_box({8.0, 8.0, 0.1});
  const PoseRefinement::Evidence evidence{std::vector<float>(camera.pixels(), 1.45F),
                                          std::vector<float>(camera.pixels(), 0.02F),
                                          std::vector<std::uint8_t>(camera.pixels(), 0)};
  PoseRefinement refinement(camera, {}, evidence, wall, Eigen::Vector3d::Zero(), 5.7);
  const geometry::Pose found = refinement.best_near(at({0.03, -0.02, 1.49}));
  EXPECT_EQ(found.translation_m.head<2>(), Eigen::Vector2d(0.03, -0.02));
  EXPECT_NEAR(found.translation_m.z(), 1.5, 0.001);
  EXPECT_NEAR(refinement.score(found), static_cast<double>(camera.pixels()), 20.0);
  Eigen::Matrix<double, 6, 1> aside = Eigen::Matrix<double, 6, 1>::Zero(), along = aside;
  aside[3] = 0.02;
  along[5] = 0.02;
  EXPECT_FALSE(refinement.tells_apart(found, aside));
  EXPECT_TRUE(refinement.tells_apart(found, along));
}

TEST(PoseRefinement, CountsWhatIsSeenThroughAgainstAPoseAndWhatIsHiddenOrExplainedNot) {
  const fusion::PinholeCamera camera{80, 60, 70.0, 70.0, 39.5, 29.5, 0.3, 4.0};
  const geometry::TriangleMesh wall = geometry::make_box({8.0, 8.0, 0.1});
  const auto score = [&](float seen_m, std::uint8_t explained) {
    const PoseRefinement::Evidence evidence{std::vector<float>(camera.pixels(), seen_m),
                                            std::vector<float>(camera.pixels(), 0.02F),
                                            std::vector<std::uint8_t>(camera.pixels(), explained)};
    return PoseRefinement(camera, {}, evidence, wall, Eigen::Vector3d::Zero(), 5.7).score(at({0, 0, 1.5}));
  };
  const auto all = static_cast<double>(camera.pixels());
  EXPECT_NEAR(score(1.45F, 0), all, 1.0);
  EXPECT_EQ(score(1.45F, 1), 0.0);
  EXPECT_EQ(score(1.48F, 0), -all);
  EXPECT_EQ(score(1.42F, 0), 0.0);
  EXPECT_EQ(score(0.0F, 0), 0.0);
}

PoseFinding elsewhere(double x_m) {
  PoseFinding finding{
      .id = 3, .name = "drum", .verdict = PoseVerdict::kElsewhere, .corrected_WO = {}, .open = {}};
  finding.shift_m = {x_m, 0.0, 0.0};
  return finding;
}

PoseFinding agrees() {
  PoseFinding finding = elsewhere(0.0);
  finding.verdict = PoseVerdict::kAgrees;
  return finding;
}

std::vector<std::string> sentences_of(const ConfirmedFindings& confirmed) {
  std::vector<std::string> sentences;
  for (const ConfirmedFinding& one : confirmed.reported())
    if (one.finding.verdict != PoseVerdict::kAgrees) sentences.push_back(sentence(one.finding));
  return sentences;
}

// Tries workspace_camera: an object stands elsewhere than the model has it, or is gone
TEST(ConfirmedFindings, ReportsWhatTwoImagesOfACameraAgreeOnAndNoLongerWhenTwoDeny) {
  ConfirmedFindings confirmed(0.015);
  confirmed.take(0, {elsewhere(0.1)});
  EXPECT_THAT(sentences_of(confirmed), IsEmpty());
  confirmed.take(1, {agrees()});
  confirmed.take(0, {elsewhere(0.102)});
  ASSERT_THAT(sentences_of(confirmed),
              ElementsAre(StartsWith("'drum' stands 0.10 m from where the model has it")));
  const auto said = sentences_of(confirmed);
  confirmed.take(0, {elsewhere(0.106)});
  EXPECT_EQ(sentences_of(confirmed), said) << "figures that hardly vary are not repeated";
  confirmed.take(0, {elsewhere(0.13)});
  EXPECT_THAT(sentences_of(confirmed), ElementsAre(HasSubstr("0.13 m")));
  confirmed.take(0, {agrees()});
  EXPECT_THAT(sentences_of(confirmed), ElementsAre(HasSubstr("0.13 m")));
  confirmed.take(0, {agrees()});
  EXPECT_THAT(sentences_of(confirmed), IsEmpty());
  confirmed.take(0, {elsewhere(0.1)});
  confirmed.take(0, {elsewhere(0.1)});
  confirmed.forget(3);
  EXPECT_THAT(sentences_of(confirmed), IsEmpty());
}

TEST(ConfirmedFindings, OneCameraThatSeesAnObjectElsewhereCountsBeforeOthersThatSeeItAgree) {
  ConfirmedFindings confirmed(0.015);
  for (int i = 0; i < 2; ++i) confirmed.take(1, {agrees()});
  ASSERT_EQ(confirmed.reported().size(), 1U);
  EXPECT_EQ(confirmed.reported()[0].finding.verdict, PoseVerdict::kAgrees);
  EXPECT_EQ(confirmed.reported()[0].camera, 1U);
  for (int i = 0; i < 2; ++i) confirmed.take(0, {elsewhere(0.1)});
  for (int i = 0; i < 2; ++i) confirmed.take(2, {agrees()});
  ASSERT_EQ(confirmed.reported().size(), 1U);
  EXPECT_EQ(confirmed.reported()[0].finding.verdict, PoseVerdict::kElsewhere);
  EXPECT_EQ(confirmed.reported()[0].camera, 0U);
}

TEST(PoseChecker, JudgesOnAThreadOfItsOwnAndForgetsWhatWasMoved) {
  const Model model;
  auto real_WO = model.X_WO;
  real_WO[2]->translation_m.x() += 0.1;
  const fusion::DepthImage image = image_of(model, real_WO, 1);
  PoseCheckRules rules;
  rules.every_s = 0.001;
  PoseChecker checker(rules, model.objects);
  for (std::size_t i = 0; i < model.objects.size(); ++i) checker.place(model.objects[i].id, model.X_WO[i]);
  const auto wait_until = [&](auto condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition() && std::chrono::steady_clock::now() < end) {
      checker.offer(0, image, {}, core::monotonic_ns());
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return condition();
  };
  const auto drum_is = [&](PoseVerdict verdict) {
    return std::ranges::any_of(checker.findings(), [&](const ConfirmedFinding& one) {
      return one.finding.id == 3 && one.finding.verdict == verdict;
    });
  };
  EXPECT_TRUE(wait_until([&] { return drum_is(PoseVerdict::kElsewhere); }));
  checker.place(3, real_WO[2]);
  EXPECT_FALSE(drum_is(PoseVerdict::kElsewhere));
  checker.place(3, model.X_WO[2]);
  EXPECT_TRUE(wait_until([&] { return drum_is(PoseVerdict::kElsewhere); }));
}

}  // namespace
}  // namespace phantom::workspace_camera::pose_check_test
