#include "common/teleop/coupling/free_handle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace phantom::teleop {
namespace {

constexpr double kStep_s = 0.002;

robot::Spatial spatial(double x_linear, double z_angular) {
  robot::Spatial value = robot::Spatial::Zero();
  value[0] = x_linear;
  value[5] = z_angular;
  return value;
}

// m·dv/dt = push·(wanted − v) from rest: v(t) = wanted·(1 − e^(−t·push/m)), whatever the step.
TEST(FreeHandle, ComesToTheWantedSpeedAsItsMassLetsIt) {
  const FreeHandleParameters parameters;
  for (const double step_s : {0.0005, kStep_s, 0.01}) {
    FreeHandle handle(parameters);
    for (int i = 1; i * step_s < 0.0501; ++i) {
      handle.lead(spatial(0.3, 0.5), robot::Spatial::Zero(), step_s);
      const double t_s = i * step_s;
      EXPECT_NEAR(handle.twist()[0], 0.3 * -std::expm1(-t_s * parameters.push_N_s_per_m / parameters.mass_kg),
                  1e-12);
      EXPECT_NEAR(handle.twist()[5],
                  0.5 * -std::expm1(-t_s * parameters.push_N_m_s_per_rad / parameters.inertia_kg_m2), 1e-12);
    }
  }
}

// At a steady speed the push equals what resists: push·(wanted − v) = F.
TEST(FreeHandle, IsSlowedDownByWhatItFeels) {
  const FreeHandleParameters parameters;
  FreeHandle handle(parameters);
  for (int i = 0; i < 1000; ++i) handle.lead(spatial(0.3, 0.5), spatial(-6.0, -0.2), kStep_s);
  EXPECT_NEAR(parameters.push_N_s_per_m * (0.3 - handle.twist()[0]), 6.0, 1e-9);
  EXPECT_NEAR(parameters.push_N_m_s_per_rad * (0.5 - handle.twist()[5]), 0.2, 1e-9);
  robot::Spatial none = robot::Spatial::Zero();
  none[2] = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 1000; ++i) handle.lead(spatial(0.3, 0.5), none, kStep_s);
  EXPECT_NEAR(handle.twist()[0], 0.3, 1e-9) << "a wrench that is none is no wrench";
}

TEST(FreeHandle, StandsWhereItsSpeedHasBroughtItAndStaysARotation) {
  FreeHandle handle({});
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d before_m = handle.pose().translation_m;
    handle.lead(spatial(0.1 * std::sin(0.01 * i), 3.0), robot::Spatial::Zero(), kStep_s);
    ASSERT_LT((handle.pose().translation_m - before_m - kStep_s * handle.twist().head<3>()).norm(), 1e-12);
  }
  const Eigen::Matrix3d& R = handle.pose().rotation;
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

// What moves as a clutch fades out moves the arm.
TEST(FreeHandle, StandsWhileAClutchMayFadeAndGoesBackToTheMiddleLater) {
  FreeHandle handle({});
  for (int i = 0; i < 1000; ++i) handle.lead(spatial(0.2, 0.0), robot::Spatial::Zero(), kStep_s);
  for (double t_s = 0.0; t_s < 0.5; t_s += kStep_s) handle.rest(kStep_s);  // until it stands
  const double stood_m = handle.pose().translation_m[0];
  for (double t_s = 0.5; t_s < FreeHandle::kRests_s - 0.01; t_s += kStep_s) handle.rest(kStep_s);
  EXPECT_NEAR(handle.pose().translation_m[0], stood_m, 1e-9);
  for (double t_s = 0.0; t_s < 5.0; t_s += kStep_s) handle.rest(kStep_s);
  EXPECT_LT(handle.pose().translation_m.norm(), 0.01);
}

TEST(FreeHandle, IsSpentAtTheEndOfItsWayUntilItIsBackInTheMiddle) {
  FreeHandle handle({});
  for (int i = 0; i < 20000 && !handle.spent(); ++i)
    handle.lead(spatial(1.0, 0.0), robot::Spatial::Zero(), kStep_s);
  EXPECT_NEAR(handle.pose().translation_m[0], FreeHandle::kWay_m, 0.01);
  for (int i = 0; i < 10000 && handle.spent(); ++i) {
    handle.rest(kStep_s);
    ASSERT_LE(handle.twist().head<3>().norm(), 1.0 + 1e-12) << "m/s, at most";
  }
  EXPECT_FALSE(handle.spent());
  EXPECT_LT(handle.pose().translation_m.norm(), 0.01);
}

}  // namespace
}  // namespace phantom::teleop
