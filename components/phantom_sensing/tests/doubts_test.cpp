// What the arm feels, held against the model: a contact that the model does not have, and none where it has
// one.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing::doubts_test {
namespace {

using percept::DoubtKind;
using percept::ModelDoubt;

constexpr double kFarFromWall_m = -0.2,
                 kAtWall_m = 0.24;  // the skin reaches to about x + 0.1, the wall from 0.35

/// As rig::hanging(), which looks at the whole workspace each time.
StepInputs hanging(double x_m, double speed_m_s) {
  static const StepInputs anywhere = rig::hanging(0.0, 0.0);
  StepInputs inputs = anywhere;
  inputs.position[0] = x_m;
  inputs.velocity[0] = speed_m_s;
  return inputs;
}

class Doubts : public testing::Test {
 protected:
  /// A place of the skin of a link in the world, with the arm at `x_m`: the one farthest along x.
  Eigen::Vector3d foremost(double x_m, std::size_t link) const {
    robot::LinkPoses X_WL;
    model_.arm.link_poses(hanging(x_m, 0.0).position, X_WL);
    Eigen::Vector3d found(-1e9, 0.0, 0.0);
    for (std::size_t i = model_.skin.first[link]; i < model_.skin.first[link + 1]; ++i) {
      const Eigen::Vector3d at_m = X_WL[link] * model_.skin.position(i);
      if (at_m.x() > found.x()) found = at_m;
    }
    return found;
  }
  static FeltForce touch(const Eigen::Vector3d& point_W_m) {
    return {.known = true, .contact = true, .located = true, .point_W_m = point_W_m, .force_N = 15.0};
  }
  /// A contact that the drives' torques tell of: of joints up to `last`.
  static FeltForce torques_up_to(std::size_t last) {
    FeltForce force{.known = true, .contact = true, .torques_known = true};
    for (std::size_t j = 0; j <= last; ++j) force.torque_Nm[j] = 3.0;
    return force;
  }
  static FeltForce nothing() { return {.known = true, .force_N = 0.0}; }

  void step(double x_m, const FeltForce& force, double seconds, double speed_m_s = 0.0) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 1000.0)); ++i) {
      StepInputs inputs = hanging(x_m, speed_m_s);
      inputs.allowed = allowed_;
      inputs.force = force;
      inputs.displaced = displaced_;
      sensing_->step(inputs, out_);
      raised_.insert(raised_.end(), out_.doubts.raised.begin(), out_.doubts.raised.end());
      ended_.insert(ended_.end(), out_.doubts.ended.begin(), out_.doubts.ended.end());
    }
  }
  void begin_with(const PerceptSettings& settings) { sensing_.emplace(model_, settings); }

  PhantomModel model_ = rig::suspended_model();
  std::optional<PhantomSensing> sensing_{std::in_place, model_, PerceptSettings()};
  percept::AllowedContact allowed_;
  DisplacedObjects displaced_;
  StepOutputs out_;
  std::vector<ModelDoubt> raised_, ended_;
};

// Tries phantom_sensing: the arm touches something where the model has nothing within its error
TEST_F(Doubts, SR23_AContactInFreeSpaceIsRaisedOnceAtItsPlaceAndEndsWithIt) {
  const Eigen::Vector3d point_m = foremost(kFarFromWall_m, 4);
  step(kFarFromWall_m, touch(point_m), 0.5);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_EQ(raised_[0].at.kind, DoubtKind::kForceInFreeSpace);
  EXPECT_EQ(raised_[0].at.link, 4U);
  EXPECT_TRUE(raised_[0].at.located);
  EXPECT_TRUE(raised_[0].at.position_W_m.isApprox(point_m));
  EXPECT_EQ(raised_[0].at.object, 0);
  EXPECT_TRUE(std::isnan(raised_[0].at.residual_m)) << "no fluid reaches so far";
  EXPECT_EQ(raised_[0].at.workspace_version, 1U);
  EXPECT_TRUE(out_.model_in_doubt);
  step(kFarFromWall_m, nothing(), 0.5);
  EXPECT_EQ(ended_.size(), 1U);
  EXPECT_FALSE(out_.model_in_doubt);
}

// Tries phantom_sensing: a depth camera sees that the object that leads the percept stands elsewhere
TEST_F(Doubts, SR28_ADisplacedObjectIsInDoubtWhileItLeadsThePercept) {
  constexpr std::uint16_t kWall = 1;
  const double near_m = kAtWall_m - 0.03;
  displaced_.add(kWall + 1);
  step(near_m, nothing(), 0.05);
  ASSERT_EQ(out_.percept.object, kWall);
  EXPECT_FALSE(out_.model_in_doubt) << "another object";
  displaced_.add(kWall);
  step(near_m, nothing(), 0.05);
  EXPECT_TRUE(out_.model_in_doubt);
  EXPECT_TRUE(raised_.empty()) << "no contact contradicts";
  step(kFarFromWall_m, nothing(), 0.05);
  EXPECT_FALSE(out_.model_in_doubt) << "the arm is far from it";
  displaced_ = {};
  step(near_m, nothing(), 0.05);
  EXPECT_FALSE(out_.model_in_doubt);
}

TEST(Displaced, MoreThanAreKeptCountAsAll) {
  DisplacedObjects objects;
  for (std::uint16_t id = 1; id <= DisplacedObjects::kMax; ++id) objects.add(id);
  EXPECT_TRUE(objects.contains(DisplacedObjects::kMax));
  EXPECT_FALSE(objects.contains(DisplacedObjects::kMax + 1));
  EXPECT_FALSE(objects.contains(0)) << "no object";
  objects.add(900);
  EXPECT_TRUE(objects.contains(901)) << "which of them is not known";
  EXPECT_FALSE(objects.contains(0));
}

TEST_F(Doubts, SR23_TheDistanceToTheObjectIsTheResidual) {
  const double x_m = kAtWall_m - 0.08;
  const Eigen::Vector3d point_m = foremost(x_m, 4);
  step(x_m, touch(point_m), 0.2);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_EQ(raised_[0].at.object, 1);
  EXPECT_NEAR(raised_[0].at.residual_m, 0.35 - point_m.x(), 0.015);
  EXPECT_GT(raised_[0].at.residual_m, 0.04) << "beyond the tolerance of four voxels";
  EXPECT_NEAR(raised_[0].at.shift_W_m.norm(), raised_[0].at.residual_m, 1e-9);
  EXPECT_LT(raised_[0].at.shift_W_m.x(), 0.0) << "the wall would have to come here";
}

TEST_F(Doubts, AContactWithinTheModelsErrorIsNone) {
  const double x_m = kAtWall_m + 0.35 - foremost(kAtWall_m, 4).x() - 0.02;  // 2 cm before the wall
  step(x_m, touch(foremost(x_m, 4)), 1.0);
  EXPECT_TRUE(raised_.empty());
  PerceptSettings exact;
  exact.doubt.tolerance_vox = 1;
  begin_with(exact);
  step(x_m, touch(foremost(x_m, 4)), 1.0);
  EXPECT_EQ(raised_.size(), 1U);
}

TEST_F(Doubts, ATorqueThatNoLinkNearABodyExplainsIsOneSomewhereOnThoseLinks) {
  step(kFarFromWall_m, torques_up_to(2), 0.2);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_EQ(raised_[0].at.link, 3U) << "the contact is not before the last joint that bears it";
  EXPECT_FALSE(raised_[0].at.located);
  EXPECT_EQ(raised_[0].at.force_N, -1.0);
}

TEST_F(Doubts, ATorqueIsExplainedByAnyLinkBehindItThatIsNearABody) {
  const double x_m = kAtWall_m + 0.35 - foremost(kAtWall_m, 4).x() - 0.02;
  step(x_m, torques_up_to(2), 1.0);
  EXPECT_TRUE(raised_.empty());
}

TEST_F(Doubts, APointOffTheSkinIsOneOnTheLineOfActionAndLinksDecide) {
  const double near_m = kAtWall_m + 0.35 - foremost(kAtWall_m, 4).x() - 0.02;
  FeltForce force = torques_up_to(2);
  force.located = true;
  force.point_W_m = {-0.9, 0.0, 1.0};
  force.force_N = 9.0;
  step(near_m, force, 1.0);
  EXPECT_TRUE(raised_.empty());
  step(kFarFromWall_m, force, 0.2);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_FALSE(raised_[0].at.located);
}

TEST_F(Doubts, AnAllowedContactIsExpected) {
  ASSERT_TRUE(allowed_.add(1, percept::AllowedContact::kWholeArm));
  const double x_m = kAtWall_m - 0.08;
  step(x_m, touch(foremost(x_m, 4)), 1.0);
  EXPECT_TRUE(raised_.empty());
}

// Tries phantom_sensing: the arm rests deep inside a body of the model, and touches nothing
TEST_F(Doubts, SR23_RestDeepInsideABodyWithoutAForceIsRaised) {
  const double x_m = kAtWall_m + 0.14;
  step(x_m, nothing(), 0.4);
  EXPECT_TRUE(raised_.empty()) << "the force may be late";
  step(x_m, nothing(), 0.3);
  ASSERT_EQ(raised_.size(), 1U);
  EXPECT_EQ(raised_[0].at.kind, DoubtKind::kNoForceInside);
  EXPECT_EQ(raised_[0].at.object, 1);
  EXPECT_LE(raised_[0].at.residual_m, -0.04);
  const Eigen::Vector3d shift_m = raised_[0].at.shift_W_m;
  EXPECT_NEAR(shift_m.norm(), -raised_[0].at.residual_m, 1e-9);
  const workspace::Workspace& voxels = *hanging(x_m, 0.0).workspace.voxels;
  const Eigen::Vector3d out_m = raised_[0].at.position_W_m - shift_m;
  EXPECT_LT(voxels.order(voxels.grid().index_of(out_m)), workspace::kOrderBoundary)
      << "so far it would have to go";
  step(x_m, touch(foremost(x_m, 4)), 0.5);
  EXPECT_EQ(ended_.size(), 1U) << "it is felt now";
}

TEST_F(Doubts, MotionAForceOrAnArmThatFeelsNothingRaisesNone) {
  const double x_m = kAtWall_m + 0.2;
  step(x_m, nothing(), 2.0, 0.1);
  step(x_m, touch(foremost(x_m, 4)), 2.0);
  step(x_m, {}, 2.0);
  step(kAtWall_m + 0.02, nothing(), 2.0);  // inside by less than the model's error
  EXPECT_TRUE(raised_.empty());
}

TEST_F(Doubts, LinksBeforeTheOneThatFeelsAreLeftOut) {
  model_.first_feeling_link = 7;
  const double x_m = kAtWall_m + 0.35 - foremost(kAtWall_m, 4).x() + 0.05;  // link 4 is inside, link 7 is not
  ASSERT_LT(foremost(x_m, 7).x(), 0.38);
  step(x_m, nothing(), 2.0);
  EXPECT_TRUE(raised_.empty());
}

TEST_F(Doubts, AStateThatIsStaleEndsThem) {
  step(kFarFromWall_m, touch(foremost(kFarFromWall_m, 4)), 0.2);
  ASSERT_TRUE(out_.model_in_doubt);
  StepInputs inputs = hanging(kFarFromWall_m, 0.0);
  inputs.state_valid = false;
  sensing_->step(inputs, out_);
  EXPECT_EQ(out_.doubts.ended.size(), 1U);
  EXPECT_FALSE(out_.model_in_doubt);
}

TEST_F(Doubts, UseNoHeap) {
  StepInputs inputs = hanging(kFarFromWall_m, 0.0);
  inputs.force = touch(foremost(kFarFromWall_m, 4));
  StepInputs inside = hanging(kAtWall_m + 0.2, 0.0);
  inside.force = nothing();
  StepInputs by_torque = inputs;
  by_torque.force = torques_up_to(2);
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) sensing_->step(inputs, out_);
  for (int i = 0; i < 700; ++i) sensing_->step(inside, out_);
  for (int i = 0; i < 100; ++i) sensing_->step(by_torque, out_);
}

TEST(FeltForce, IsKnownWhereAForceIsMeasuredAndLocatedWhereItsPlaceIs) {
  messages::SlaveState state;
  EXPECT_FALSE(force_of(state).known) << "an arm that measures nothing";
  state.contact_force_N = 0.0;
  EXPECT_TRUE(force_of(state).known);
  EXPECT_FALSE(force_of(state).located);
  state.contact = true;
  state.contact_force_N = 3.0;
  state.contact_point_m = {0.1, 0.2, 0.3};
  EXPECT_TRUE(force_of(state).located);
  EXPECT_TRUE(force_of(state).point_W_m.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3)));
  state.contact_force_N = -1.0;
  state.force_measured = true;
  EXPECT_TRUE(force_of(state).known);
  EXPECT_FALSE(force_of(state).located);
}

}  // namespace
}  // namespace phantom::phantom_sensing::doubts_test
