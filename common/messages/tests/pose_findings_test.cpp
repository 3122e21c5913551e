#include "common/messages/pose_findings.hpp"

#include <gtest/gtest.h>

namespace phantom::messages {
namespace {

PoseFinding a_finding(std::uint16_t id, PoseVerdict verdict, double x_m = 0.0) {
  PoseFinding finding{.id = id, .verdict = verdict, .camera = "above"};
  finding.X_WO.translation_m.x() = x_m;
  return finding;
}

TEST(PoseFindings, HoldOnlyForThePoseThatWasJudged) {
  PoseFindings findings;
  const geometry::Pose judged, moved{Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0}};
  EXPECT_EQ(findings.displacing(3, judged), nullptr);
  for (const PoseVerdict verdict : {PoseVerdict::kElsewhere, PoseVerdict::kGone, PoseVerdict::kUnclear}) {
    ASSERT_TRUE(findings.take(a_finding(3, verdict)));
    ASSERT_NE(findings.displacing(3, judged), nullptr);
    EXPECT_EQ(findings.displacing(3, judged)->verdict, verdict);
    EXPECT_EQ(findings.displacing(3, moved), nullptr) << "it was moved since";
    EXPECT_EQ(findings.displacing(4, judged), nullptr);
  }
  ASSERT_TRUE(findings.take(a_finding(3, PoseVerdict::kAgrees)));
  EXPECT_EQ(findings.displacing(3, judged), nullptr);
  EXPECT_NE(findings.of(3), nullptr);
}

TEST(PoseFindings, AreBoundedAndKnownObjectsGoOn) {
  PoseFindings findings;
  for (std::size_t i = 0; i < PoseFindings::kMax; ++i)
    ASSERT_TRUE(findings.take(a_finding(static_cast<std::uint16_t>(1 + i), PoseVerdict::kGone)));
  EXPECT_FALSE(findings.take(a_finding(60'000, PoseVerdict::kGone)));
  EXPECT_EQ(findings.of(60'000), nullptr);
  EXPECT_TRUE(findings.take(a_finding(7, PoseVerdict::kUnclear)));
  EXPECT_EQ(findings.of(7)->verdict, PoseVerdict::kUnclear);
}

}  // namespace
}  // namespace phantom::messages
