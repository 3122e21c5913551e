#include "components/slave_io/model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/geometry/primitives.hpp"
#include "common/runtime/cell_bodies.hpp"
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

// Oracle: a sphere, whose distance everybody knows.
TEST(FieldWorld, DistanceAndNormalOfASphere) {
  runtime::CellConfig cell;
  cell.min_m = {-0.5, -0.5, -0.5};
  cell.max_m = {0.5, 0.5, 0.5};
  const double radius_m = 0.2;
  auto mesh = geometry::make_sphere(radius_m, 5);
  const FieldWorld world(cell, {{mesh, 5}}, ContactConfig{});
  for (double along = 0.17; along < 0.32; along += 0.003) {
    const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 0.5, -0.7 + along).normalized();
    const double expected_m = along - radius_m;
    const auto found = world.query(along * direction);
    const double tolerance_m = std::abs(expected_m) < 0.02 ? 0.0015 : 0.004;
    EXPECT_NEAR(found.distance_m, expected_m, tolerance_m) << along;
    EXPECT_EQ(found.distance_m, world.distance_m(along * direction));
    EXPECT_GT(found.normal_W.dot(direction), 0.98) << along;
    EXPECT_NEAR(found.normal_W.norm(), 1.0, 1e-9);
    EXPECT_EQ(found.object, 5);
  }
  EXPECT_GE(world.distance_m({0.45, 0.45, 0.45}), world.range_m());
}

// SIGTERM while it starts: it is asked all the time, in the fine field and in the coarse one.
TEST(FieldWorld, EndsWhenItIsToldTo) {
  const auto bodies = runtime::load_real_bodies(hot_cell());
  const auto asked_until_ended = [&bodies](int most) {
    std::atomic<int> asked{0};
    EXPECT_THROW(FieldWorld(hot_cell(), bodies, ContactConfig{}, [&] { return ++asked <= most; }),
                 FieldWorld::Ended);
    return asked.load();
  };
  std::atomic<int> in_all{0};
  const FieldWorld world(hot_cell(), bodies, ContactConfig{}, [&] { return ++in_all > 0; });
  EXPECT_GT(in_all, 500) << "for more than a second of work";
  for (const int most : {0, in_all / 3, in_all * 9 / 10})
    EXPECT_LE(asked_until_ended(most), most + 50) << "those that work at that moment, once each";
}

}  // namespace
}  // namespace phantom::slave_io
