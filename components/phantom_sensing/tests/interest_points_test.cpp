// What interest points perceive, beside the whole skin, and their alerts.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::hanging;

/// At q = (x, 0 …) the arm hangs down and moves along x; the wall's surface is at x = 0.35 m.
PhantomModel watched_model() {
  PhantomModel model = rig::suspended_model();
  model.interest_points = {{"tip", 7, {0, 0, 0}}, {"carriage", 1, {0.05, 0, 0}}};
  return model;
}

class Interest : public testing::Test {
 protected:
  PhantomModel model_ = watched_model();
  PhantomSensing sensing_{model_, {}};
  StepOutputs out_;
};

TEST_F(Interest, KnowWhereTheyAreAlsoInFreeSpace) {
  sensing_.step(hanging(-0.4, 0.2), out_);
  ASSERT_EQ(out_.interest.size(), 2U);
  robot::LinkPoses X_WL;
  model_.arm.link_poses(hanging(-0.4, 0.2).position, X_WL);
  for (std::size_t i = 0; i < 2; ++i) {
    const InterestPoint& point = model_.interest_points[i];
    EXPECT_TRUE(out_.interest[i].position_W_m.isApprox(X_WL[point.link] * point.position_m));
    EXPECT_TRUE(out_.interest[i].velocity_W_m_s.isApprox(Eigen::Vector3d(0.2, 0, 0), 1e-12));
    EXPECT_EQ(out_.interest[i].mu, 0.0);
    EXPECT_EQ(out_.interest[i].closeness, 0.0);
    EXPECT_EQ(out_.interest[i].motion, percept::MotionClass::kNone);
  }
}

TEST_F(Interest, PerceiveTheMuOfTheirVoxelAndTheMotion) {
  for (const double x : {0.2, 0.25, 0.3}) {
    sensing_.step(hanging(x, 0.3), out_);
    for (const InterestPercept& point : out_.interest) {
      const double expected =
          static_cast<double>(rig::wall().mu(rig::wall().grid().index_of(point.position_W_m)));
      EXPECT_EQ(point.mu, expected);
      EXPECT_DOUBLE_EQ(point.closeness, std::min(1.0, expected / 32.0));
      if (expected == 0.0) continue;
      EXPECT_EQ(point.object, 1);
      EXPECT_GT(point.gradient.pgv_W_m.x(), 0.0);
      EXPECT_EQ(point.motion, percept::MotionClass::kDangerous);
    }
    EXPECT_GE(out_.percept.mu, out_.interest[0].mu)
        << "the skin's worst sensor is farther out than the point";
  }
}

TEST_F(Interest, SR20_AndTheSkinOfTheirLinkRaiseOneAlertForOneThreat) {
  std::vector<percept::Alert> raised;
  StepOutputs out;
  bool several_places = false;
  for (double x = 0.05; x < 0.34; x += 0.002) {
    sensing_.step(hanging(x, 0.3, 0.05), out);
    raised.insert(raised.end(), out.alerts.raised.begin(), out.alerts.raised.end());
    several_places = several_places || (out.interest[0].rule != percept::HitRule::kNone &&
                                        out.percept.rule != percept::HitRule::kNone);
  }
  EXPECT_TRUE(several_places);
  ASSERT_GE(raised.size(), 2U);
  std::map<std::size_t, int> times, very_close;
  for (std::size_t i = 0; i < raised.size(); ++i) {
    EXPECT_EQ(raised[i].number, i + 1);
    ++(raised[i].rule == percept::HitRule::kVeryClose ? very_close : times)[raised[i].at.link];
  }
  for (const auto& [link, count] : times) EXPECT_EQ(count, 1) << "link " << link;
  for (const auto& [link, count] : very_close) EXPECT_EQ(count, 1) << "link " << link;
}

TEST_F(Interest, RaiseAnAlertWhereTheSkinFeelsNothing) {
  model_.interest_points[1].position_m = {0.2, 0.0, 0.0};  // a motor that has no skin
  PhantomSensing sensing(model_, {});
  sensing.step(hanging(0.0, 0.3), out_);
  ASSERT_GT(out_.interest[1].mu, 0.0);
  ASSERT_EQ(out_.worst.mu, 0.0) << "it reaches farther than the skin";
  ASSERT_EQ(out_.alerts.raised.size(), 1U);
  const percept::HitCandidate& at = out_.alerts.raised.front().at;
  EXPECT_EQ(at.interest_point, 1);
  EXPECT_EQ(at.link, 1U);
  EXPECT_EQ(at.position_W_m, out_.interest[1].position_W_m);
  EXPECT_EQ(out_.percept.position_W_m, out_.interest[1].position_W_m) << "it leads";
}

TEST_F(Interest, HaveTheirLinksAlertsEndWhenTheStateIsStale) {
  sensing_.step(hanging(0.3, 0.3), out_);
  const auto raised = out_.alerts.raised;
  ASSERT_FALSE(raised.empty());
  sensing_.step(hanging(0.31, 0.3), out_);
  StepInputs stale = hanging(0.3, 0.3);
  stale.state_valid = false;
  sensing_.step(stale, out_);
  ASSERT_EQ(out_.alerts.cleared.size(), raised.size());
  for (const percept::Alert& alert : raised) {
    const auto ended = std::ranges::find(out_.alerts.cleared, alert.number, &percept::Alert::number);
    ASSERT_NE(ended, out_.alerts.cleared.end());
    EXPECT_EQ(ended->at.position_W_m, alert.at.position_W_m) << "it was latched";
  }
  EXPECT_EQ(out_.interest[0].mu, 0.0);
  EXPECT_EQ(out_.interest[0].position_W_m, Eigen::Vector3d::Zero());
}

TEST_F(Interest, MutedOnesSayThatTheyAre) {
  StepInputs inputs = hanging(0.3, 0.3);
  inputs.allowed.add(1, 7);
  sensing_.step(inputs, out_);
  EXPECT_TRUE(out_.interest[0].muted);
  EXPECT_EQ(out_.interest[0].mu, 0.0);
  EXPECT_EQ(out_.interest[0].object, 1);
  for (const Threat& threat : out_.threats) EXPECT_NE(threat.link, 7U);
  EXPECT_FALSE(out_.interest[1].muted);
}

TEST_F(Interest, OutOfTheGridIsFreeSpace) {
  model_.interest_points[0].position_m = {100.0, 0, 0};
  PhantomSensing sensing(model_, {});
  sensing.step(hanging(0.3, 0.3), out_);
  EXPECT_TRUE(out_.valid);
  EXPECT_EQ(out_.interest[0].mu, 0.0);
}

TEST_F(Interest, UseNoHeap) {
  StepInputs inputs = hanging(0.3, 0.3);
  const ::phantom::test::HeapGuard no_heap;
  for (int i = 0; i < 50; ++i) {
    inputs.position[0] -= 0.01;
    inputs.velocity[0] = -inputs.velocity[0];
    sensing_.step(inputs, out_);
  }
}

}  // namespace
}  // namespace phantom::phantom_sensing
