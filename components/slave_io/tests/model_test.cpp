#include "components/slave_io/model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/simulation/contact_points.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {
namespace {

TEST(SlaveModel, ContactPointsKeepToTheirNumberAndLieOnTheSkin) {
  const auto& model = shipped_arm();
  for (const int most : {400, 1000, 3000}) {
    const auto points = simulation::contact_points(model.arm, model.skin, 0.02, most);
    EXPECT_LE(static_cast<int>(points.size()), most);
    EXPECT_GT(static_cast<int>(points.size()), most / 3);
    double lowest_tip_m = 0.0;
    for (const auto& point : points) {
      ASSERT_GE(point.link, 1U);
      ASSERT_LE(point.link, model.arm.joint_count());
      if (point.link == model.arm.joint_count()) lowest_tip_m = std::min(lowest_tip_m, point.position_m.z());
    }
    EXPECT_NEAR(lowest_tip_m, -0.162, 0.005) << "the fingertips must be able to touch";
  }
}

TEST(SlaveModel, SkinOfAnUnknownLinkIsNamed) {
  ArmModel model = shipped_arm();
  model.skin.front().link = "tentacle";
  EXPECT_THAT([&] { simulation::contact_points(model.arm, model.skin, 0.02, 1000); },
              testing::ThrowsMessage<core::ConfigError>(testing::HasSubstr("tentacle")));
}

TEST(SlaveModel, HomeThatDoesNotFitTheArmIsNamed) {
  auto cell = hot_cell();
  cell.arms.front().home.push_back(0.0);
  EXPECT_THAT([&] { load_arm(cell, ""); },
              testing::ThrowsMessage<core::ConfigError>(
                  testing::AllOf(testing::HasSubstr("home: has 8 values"), testing::HasSubstr("7"))));
  cell.arms.front().home = {9.0, 0, 0, 0, 0, 0, 0};
  EXPECT_THAT([&] { load_arm(cell, ""); },
              testing::ThrowsMessage<core::ConfigError>(
                  testing::AllOf(testing::HasSubstr("j1_gantry"), testing::HasSubstr("allowed: -0.45"))));
}

TEST(SlaveModel, BodiesStandWhereTheyReallyAre) {
  auto cell = hot_cell();
  const auto as_deviating = runtime::load_real_bodies(cell);
  for (auto& object : cell.objects) object.X_deviation = {};
  const auto as_modelled = runtime::load_real_bodies(cell);
  ASSERT_EQ(as_deviating.size(), cell.objects.size());
  for (std::size_t i = 0; i < cell.objects.size(); ++i) {
    EXPECT_EQ(as_deviating[i].id, i + 1);
    const auto& real = hot_cell().objects[i].X_deviation;
    const bool deviates = real.translation_m.norm() > 0.0;
    const double moved_m =
        (as_deviating[i].mesh_W.vertices_m.front() - as_modelled[i].mesh_W.vertices_m.front())
            .cast<double>()
            .norm();
    EXPECT_EQ(moved_m > 1e-6, deviates) << cell.objects[i].name;
  }
}

}  // namespace
}  // namespace phantom::slave_io
