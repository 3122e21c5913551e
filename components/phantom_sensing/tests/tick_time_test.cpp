#include "components/phantom_sensing/tools/tick_time.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing {
namespace {

using testing::HasSubstr;

TEST(TickTime, IsMeasuredInFreeSpaceAndWhereATickCostsMost) {
  const PhantomModel model = rig::suspended_model();
  TickCase at;
  at.grid = rig::wall().grid();
  at.palette = rig::wall().palette();
  const TickTime time = time_tick(model, {}, at, 0.05);
  EXPECT_GT(time.free_s, 0.0);
  EXPECT_GT(time.full_s, time.free_s);
  EXPECT_GE(time.full_p99_s, time.full_s);
}

TEST(TickTime, TakesAPoseOutsideOfTheGridAndJointsWithoutRange) {
  PhantomModel model{robot::test_arms::planar(robot::test_arms::at(100.0, 0.0, 0.0)), {}, {}};
  robot::SkinSegment tube;
  tube.to_m = {0.3, 0.0, 0.0};
  tube.from_radius_m = 0.05;
  model.skin = *robot::lay_out_skin(model.arm, {{"upper", {tube}, {}, {}}}, {.voxel_size_m = 0.01});
  TickCase at;
  at.grid = rig::wall().grid();
  at.palette = rig::wall().palette();
  at.home[0] = 50.0;
  EXPECT_GT(time_tick(model, {}, at, 0.01).full_s, 0.0);
}

TEST(TickTime, IsToldAgainstThePeriod) {
  EXPECT_EQ(describe({20e-6, 50e-6, 61e-6}),
            "a tick takes 20 us in free space and 50 us where it takes longest, "
            "the whole skin in mixed fluid (99 of 100: 61 us): 5 % of the 1 ms between two slave_states");
  EXPECT_THAT(describe({20e-6, 1.2e-3, 2e-3}), HasSubstr("longer than the 1 ms between two slave_states"));
}

}  // namespace
}  // namespace phantom::phantom_sensing
