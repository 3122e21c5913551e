#include "components/workspace_survey/touch_watch.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "common/robot/kinematics/jacobian.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::HasSubstr;

constexpr std::uint16_t kFixture = 2, kTable = 1;

/// The bench's probing arm, whose states a test writes itself.
class TouchWatchTest : public testing::Test {
 protected:
  TouchWatchTest() {
    state_.joint_count = 5;
    state_.position = {0.36, 0.338, 0.1, 0.3, 0.2};
    state_.force_measured = true;
  }

  Eigen::Vector3d tip_W_m() const {
    robot::LinkPoses X_WL;
    arm_.link_poses(state_.position, X_WL);
    return robot::tool_pose(arm_, X_WL).translation_m;
  }
  /// From now on a force acts on the arm at a place; it is known as the simulated arm knows it.
  void press(const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& force_W_N,
             std::uint16_t object = kFixture) {
    robot::LinkPoses X_WL;
    arm_.link_poses(state_.position, X_WL);
    state_.external_torque_Nm = {};
    arm_.add_force(arm_.joint_count(), p_W_m, force_W_N, X_WL, state_.external_torque_Nm);
    state_.contact = true;
    state_.contact_force_N = force_W_N.norm();
    state_.contact_object = object;
    state_.contact_point_m = messages::vector_of(p_W_m);
  }
  void let_go() {
    state_.contact = false;
    state_.contact_force_N = 0.0;
    state_.external_torque_Nm = {};
  }
  /// The contacts that are found while states go on as they are.
  std::vector<FeltContact> go_on(TouchWatch& watch, double for_s) {
    std::vector<FeltContact> found;
    for (int i = 0; i < static_cast<int>(for_s * 1000 + 0.5); ++i, now_s_ += 0.001) {
      if (auto felt = watch.take(state_, now_s_, kFixture)) found.push_back(*felt);
    }
    return found;
  }

  runtime::CellConfig cell_ = runtime::load_cell(source("deploy/cells/touch_bench/cell.yaml"));
  robot::SerialArm arm_ = runtime::load_arm(cell_.arm());
  messages::SlaveState state_;
  double now_s_ = 100.0;
};

TEST_F(TouchWatchTest, AContactAfterAWhileWithoutOneIsOneTouchWithItsPlaceAndDirection) {
  TouchWatch watch(arm_, {.tip_radius_m = std::nullopt, .sigma_m = 0.0004});
  EXPECT_TRUE(go_on(watch, 0.2).empty());
  const Eigen::Vector3d at = tip_W_m() + Eigen::Vector3d(0.002, 0, 0), normal(0.6, 0, 0.8);
  press(at, 2.0 * normal);
  const auto found = go_on(watch, 0.5);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_TRUE(found[0].touch) << found[0].refusal;
  EXPECT_NEAR((found[0].touch->p_W_m - at).norm(), 0.0, 1e-12);
  EXPECT_EQ(found[0].touch->radius_m, 0.0);
  EXPECT_EQ(found[0].touch->sigma_m, 0.0004);
  ASSERT_TRUE(found[0].touch->normal_W);
  EXPECT_NEAR((*found[0].touch->normal_W - normal).norm(), 0.0, 1e-9);

  let_go();  // it bounces: no new touch
  EXPECT_TRUE(go_on(watch, 0.05).empty());
  press(at, normal);
  EXPECT_TRUE(go_on(watch, 0.2).empty());
  let_go();
  EXPECT_TRUE(go_on(watch, 0.15).empty());
  press(at, normal);
  EXPECT_EQ(go_on(watch, 0.2).size(), 1u);
}

TEST_F(TouchWatchTest, ThePlaceIsThatOfTheContactsBeginningThoughTheArmSlidesOn) {
  TouchWatch watch(arm_, {});
  go_on(watch, 0.2);
  const Eigen::Vector3d at = tip_W_m();
  press(at, {0, 0, 5});
  go_on(watch, 0.01);
  state_.position[0] += 0.01;
  press(tip_W_m(), {0, 0, 5});
  const auto found = go_on(watch, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR((found[0].touch->p_W_m - at).norm(), 0.0, 1e-12);
}

TEST_F(TouchWatchTest, AShortContactIsATouchToo) {
  TouchWatch watch(arm_, {});
  go_on(watch, 0.2);
  press(tip_W_m(), {0, 0, 5});
  go_on(watch, 0.005);
  let_go();
  const auto found = go_on(watch, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].touch->normal_W);
}

TEST_F(TouchWatchTest, AContactThatBeganBeforeItListenedIsNone) {
  TouchWatch watch(arm_, {});
  press(tip_W_m(), {0, 0, 5});
  EXPECT_TRUE(go_on(watch, 1.0).empty());
}

TEST_F(TouchWatchTest, WithoutAForceOrWithOneThatActsElsewhereTheDirectionIsUnknown) {
  TouchWatch watch(arm_, {});
  go_on(watch, 0.2);
  press(tip_W_m(), {0, 0, 5});
  state_.external_torque_Nm[4] += 3.0;  // as a force far behind the tip would
  auto found = go_on(watch, 0.1);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_TRUE(found[0].touch);
  EXPECT_FALSE(found[0].touch->normal_W);
  let_go();
  go_on(watch, 0.2);
  press(tip_W_m(), {0, 0, 5});
  state_.force_measured = false;
  found = go_on(watch, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].touch->normal_W);
}

TEST_F(TouchWatchTest, WithAProbingToolTheBallAtTheTipIsThePlaceAlsoWhereTheArmDoesNotSayIt) {
  TouchWatch watch(arm_, {.tip_radius_m = 0.004, .sigma_m = 0.0005});
  go_on(watch, 0.2);
  press(tip_W_m() - Eigen::Vector3d(0, 0, 0.004), {0, 0, 5});
  state_.contact_force_N = -1.0;  // as drives' torques say it
  state_.contact_object = 0;
  const auto found = go_on(watch, 0.1);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_TRUE(found[0].touch) << found[0].refusal;
  EXPECT_NEAR((found[0].touch->p_W_m - tip_W_m()).norm(), 0.0, 1e-12);
  EXPECT_EQ(found[0].touch->radius_m, 0.004);
  EXPECT_NEAR(found[0].touch->normal_W->z(), 1.0, 1e-9);
}

// Tries workspace_survey: a contact is of another object; beside the tool's tip; of an arm that does not say
// where
TEST_F(TouchWatchTest, ContactsThatSayNothingAboutTheObjectAreLeftOutWithTheReason) {
  TouchWatch without(arm_, {}), with(arm_, {.tip_radius_m = 0.004, .sigma_m = 0.0005});
  go_on(without, 0.2);
  go_on(with, 0.2);
  press(tip_W_m(), {0, 0, 5}, kTable);
  auto found = go_on(without, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].touch);
  EXPECT_THAT(found[0].refusal, HasSubstr("another object (id 1)"));

  press(tip_W_m() + Eigen::Vector3d(0, 0, 0.1), {1, 0, 0});
  found = go_on(with, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0].refusal, HasSubstr("100 mm beside the tool's tip"));

  let_go();
  go_on(without, 0.2);
  press(tip_W_m(), {0, 0, 5});
  state_.contact_force_N = -1.0;
  found = go_on(without, 0.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0].refusal, HasSubstr("--tip-radius-mm"));
}

TEST_F(TouchWatchTest, APlaceWithoutContactIsThatOfTheBall) {
  TouchWatch without(arm_, {}), with(arm_, {.tip_radius_m = 0.004, .sigma_m = 0.0005});
  EXPECT_FALSE(with.free_place()) << "nothing is known yet";
  go_on(without, 0.01);
  go_on(with, 0.01);
  EXPECT_FALSE(without.free_place());
  ASSERT_TRUE(with.free_place());
  EXPECT_NEAR((with.free_place()->p_W_m - tip_W_m()).norm(), 0.0, 1e-12);
  press(tip_W_m(), {0, 0, 5});
  go_on(with, 0.01);
  EXPECT_FALSE(with.free_place());
}

}  // namespace
}  // namespace phantom::workspace_survey
