#include "common/teleop/rendering/drag_masking.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr double kTick_s = 0.001, kWeber = 0.08, kFloor_Nm = 0.05;

MaskingParameters two_joints() {
  MaskingParameters p{.joint_count = 2, .weber_fraction = kWeber, .drag_floor_Nm = {}};
  p.drag_floor_Nm.fill(kFloor_Nm);
  return p;
}

using Torque = std::function<core::JointArray(double t_s)>;

Torque constant(double first_Nm, double second_Nm = 0.0) {
  return [=](double) {
    core::JointArray torque_Nm{};
    torque_Nm[0] = first_Nm;
    torque_Nm[1] = second_Nm;
    return torque_Nm;
  };
}

/// Returns a monitor after `time_s` of these torques.
MaskingMonitor after(double time_s, const Torque& drag, const Torque& feedback) {
  MaskingMonitor monitor(two_joints());
  for (int i = 0; i * kTick_s < time_s; ++i) monitor.step(drag(i * kTick_s), feedback(i * kTick_s), kTick_s);
  return monitor;
}

TEST(MaskingMonitor, AConstantWeightMasksWhatIsBelowTheWeberFractionOfIt) {
  EXPECT_TRUE(after(3.0, constant(0.95 * kWeber * 4.0), constant(4.0)).masked());
  EXPECT_FALSE(after(3.0, constant(1.05 * kWeber * 4.0), constant(4.0)).masked());
  EXPECT_TRUE(after(3.0, constant(-0.95 * kWeber * 4.0), constant(4.0)).masked());
  EXPECT_TRUE(after(3.0, constant(0.95 * kWeber * 4.0), constant(-4.0)).masked());
}

TEST(MaskingMonitor, WithoutFeedbackNothingIsMasked) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-3.0, 3.0);
  MaskingMonitor monitor(two_joints());
  for (int i = 0; i < 20'000; ++i) {
    core::JointArray drag_Nm{};
    drag_Nm[0] = any(random);
    drag_Nm[1] = any(random);
    monitor.step(drag_Nm, {}, kTick_s);
    ASSERT_FALSE(monitor.masked());
    ASSERT_EQ(monitor.masked_share(), 0.0);
  }
}

TEST(MaskingMonitor, AFeedbackThatChangesAsMuchAsTheDragMasksIt) {
  const Torque swings = [](double t_s) { return constant(std::sin(20.0 * t_s))(t_s); };
  EXPECT_TRUE(after(4.0, constant(0.4), swings).masked());
  EXPECT_FALSE(after(4.0, constant(1.2), swings).masked());
  // The same level at rest masks a hundredth of it alone.
  EXPECT_FALSE(after(4.0, constant(0.4), constant(1.0)).masked());
}

TEST(MaskingMonitor, DragThatStandsApartOnOneJointIsEnough) {
  EXPECT_TRUE(after(3.0, constant(0.2, 0.2), constant(4.0, 4.0)).masked());
  EXPECT_FALSE(after(3.0, constant(0.2, 0.2), constant(4.0, 0.5)).masked());
  // A joint without drag is no place where drag stands apart.
  EXPECT_TRUE(after(3.0, constant(0.2, 0.0), constant(4.0, 0.0)).masked());
}

TEST(MaskingMonitor, NeitherFreeSpaceNorAFaintDragIsJudged) {
  EXPECT_EQ(after(3.0, constant(0.0), constant(4.0)).masked_share(), 0.0);
  EXPECT_EQ(after(3.0, constant(kFloor_Nm), constant(4.0)).masked_share(), 0.0);
}

TEST(MaskingMonitor, IsHeldUntilMostDragStandsApartAndAcrossFreeSpace) {
  MaskingMonitor monitor = after(3.0, constant(0.2), constant(4.0));
  ASSERT_TRUE(monitor.masked());
  const auto go_on = [&](double time_s, double drag_Nm) {
    for (int i = 0; i * kTick_s < time_s; ++i)
      monitor.step(constant(drag_Nm)(0.0), constant(4.0)(0.0), kTick_s);
  };
  go_on(5.0, 0.0);
  EXPECT_TRUE(monitor.masked()) << "free space tells nothing";
  go_on(0.5, 1.0);
  EXPECT_TRUE(monitor.masked()) << monitor.masked_share();
  go_on(1.5, 1.0);
  EXPECT_FALSE(monitor.masked()) << monitor.masked_share();
  go_on(0.5, 0.2);
  EXPECT_FALSE(monitor.masked()) << "an outer layer's faint drag on the way in";
  monitor.reset();
  EXPECT_EQ(monitor.masked_share(), 0.0);
}

TEST(MaskingMonitor, DoesNotAllocate) {
  MaskingMonitor monitor(two_joints());
  const core::JointArray drag_Nm = constant(0.2, 0.1)(0.0), feedback_Nm = constant(4.0, 1.0)(0.0);
  {
    const test::HeapGuard guard;
    for (int i = 0; i < 2000; ++i) monitor.step(drag_Nm, feedback_Nm, kTick_s);
  }
  EXPECT_FALSE(monitor.masked_share() > 1.0);
}

}  // namespace
}  // namespace phantom::teleop
