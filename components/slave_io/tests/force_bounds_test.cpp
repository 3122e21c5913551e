// Of the objects that bear only so much, those count that the arm may be touching.
#include "components/slave_io/force_bounds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {
namespace {

using Place = BoundedPlaces::Place;

constexpr double kSide_m = 0.1, kHalf_m = 0.5 * kSide_m;
const Eigen::AlignedBox3d kCube(Eigen::Vector3d::Constant(-kHalf_m), Eigen::Vector3d::Constant(kHalf_m));

geometry::Pose at(double x_m, double y_m = 0.0, double z_m = 0.0) {
  return {Eigen::Matrix3d::Identity(), {x_m, y_m, z_m}};
}

/// An arm of one link, a cube around W's origin.
struct OneLink {
  OneLink() { boxes[1] = kCube; }
  LinkBoxes boxes;
  robot::LinkPoses X_WL;
};

struct Bounds : OneLink, testing::Test {
  std::vector<ObjectForceBound> objects{{2, "gauge", 8.0, 0.0, kCube, at(0.3)},
                                        {5, "window", 20.0, 0.0, kCube, at(0.1)}};
  ForceBounds bounds() const { return {objects, boxes}; }
};

TEST_F(Bounds, AreThoseOfWhatIsTouched) {
  EXPECT_EQ(bounds().of(2, X_WL).force_N, 8.0);
  EXPECT_EQ(bounds().of(2, X_WL).object, 2);
  EXPECT_EQ(bounds().of(5, X_WL).force_N, 20.0);
  EXPECT_EQ(bounds().of(3, X_WL).force_N, 0.0) << "it bears any force";
}

TEST_F(Bounds, OfWhatIsNotKnownAreTheLeastWithinReach) {
  EXPECT_EQ(bounds().of(0, X_WL).object, 5) << "the gauge is out of reach";
  const double reach_m = kSide_m + ForceBounds::kReach_m;
  objects[0].X_WO = at(reach_m + 1e-3);
  EXPECT_EQ(bounds().of(0, X_WL).object, 5);
  objects[0].X_WO = at(reach_m - 1e-3);
  EXPECT_EQ(bounds().of(0, X_WL).force_N, 8.0);
  EXPECT_EQ(bounds().of(0, X_WL).object, 2);
  objects[0].X_WO = at(0.3);
  objects[0].pose_error_m = 0.16;
  EXPECT_EQ(bounds().of(0, X_WL).object, 2) << "it may be 0.16 m nearer";
  objects[0].pose_error_m = 0.0;
  X_WL[1] = at(0.3);
  EXPECT_EQ(bounds().of(0, X_WL).object, 2) << "the arm has moved";
  X_WL[1] = at(-1.0);
  EXPECT_EQ(bounds().of(0, X_WL).force_N, 0.0) << "none is within reach";
}

TEST_F(Bounds, OfWhatMayBeAnywhereCountAlways) {
  X_WL[1] = at(-1.0);
  ForceBounds all = bounds();
  BoundedPlaces places;
  places.carries = true;  // and what it carries may touch anything
  all.place(places);
  EXPECT_EQ(all.of(0, X_WL).object, 2);
  places = {};
  places.objects[1].place = Place::kAnywhere;
  all.place(places);
  EXPECT_EQ(all.of(0, X_WL).object, 5);
  objects[0].X_WO.reset();
  EXPECT_EQ(bounds().of(0, X_WL).object, 2) << "something moves it";
  objects[0].X_WO = at(0.3);
  objects[0].box_O_m.setEmpty();
  EXPECT_EQ(bounds().of(0, X_WL).object, 2) << "nobody knows how large it is";
  EXPECT_EQ(ForceBounds(objects, {}).of(0, X_WL).object, 2) << "nobody knows how large the arm is";
  EXPECT_EQ(ForceBounds({}, boxes).of(0, X_WL).force_N, 0.0);
}

TEST_F(Bounds, FollowWhereTheObjectsAre) {
  ForceBounds moving = bounds();
  BoundedPlaces places;
  places.stand_at(0, at(0.0, 0.12));
  moving.place(places);
  EXPECT_EQ(moving.of(0, X_WL).object, 2);
  places.objects[0].place = Place::kGone;
  moving.place(places);
  EXPECT_EQ(moving.of(0, X_WL).object, 5);
  moving.place({});
  EXPECT_EQ(moving.of(0, X_WL).object, 5) << "back where the cell file has it";
}

geometry::Pose random_pose(std::mt19937& random, double reach_m) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> way(-reach_m, reach_m);
  return {
      geometry::rotation_from_quaternion({normal(random), normal(random), normal(random), normal(random)}),
      {way(random), way(random), way(random)}};
}

/// Least distance of two boxes by alternating projections (W. Cheney, A. Goldstein, Proc. AMS 10 (1959) 448),
/// which come from above: the distance is no greater.
double distance_m(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b, const geometry::Pose& X_AB) {
  const auto nearest_in = [](const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p.cwiseMax(box.min()).cwiseMin(box.max()));
  };
  Eigen::Vector3d in_b = X_AB * b.center(), in_a = a.center();
  for (int i = 0; i < 2000; ++i) {
    in_a = nearest_in(a, in_b);
    in_b = X_AB * nearest_in(b, X_AB.inverse() * in_a);
  }
  return (in_a - in_b).norm();
}

// Corners that are nearest to each other are seen at an angle by every axis, so they may seem nearer.
TEST(ForceBoundsReach, IsTheDistanceOfBoxesOrSafelyMore) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> side(0.02, 0.4);
  int near = 0, far = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto box = [&] {
      const Eigen::Vector3d half(side(random), side(random), side(random));
      const Eigen::Vector3d centre(side(random), -side(random), side(random));
      return Eigen::AlignedBox3d(centre - half, centre + half);
    };
    OneLink arm;
    arm.boxes[1] = box();
    arm.X_WL[1] = random_pose(random, 1.0);
    const ObjectForceBound object{1, "thing", 5.0, 0.0, box(), random_pose(random, 1.0)};
    const bool counts = ForceBounds({object}, arm.boxes).of(0, arm.X_WL).force_N > 0.0;
    const double apart_m = distance_m(arm.boxes[1], object.box_O_m, arm.X_WL[1].inverse() * *object.X_WO);
    if (apart_m < ForceBounds::kReach_m) {
      EXPECT_TRUE(counts) << apart_m;
      ++near;
    }
    if (apart_m > 2.5 * ForceBounds::kReach_m) {
      EXPECT_FALSE(counts) << apart_m;
      ++far;
    }
  }
  EXPECT_GT(near, 100);
  EXPECT_GT(far, 100);
}

TEST(ForceBoundsOfACell, AreReadWithTheBoxesOfTheirObjects) {
  runtime::CellConfig cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  cell.objects.at(1).max_contact_force_N = 12.0;
  cell.objects.at(1).pose_error_m = 0.004;
  const auto bounds = object_bounds_with_boxes(cell);
  ASSERT_EQ(bounds.size(), 1U);
  EXPECT_EQ(bounds[0].object, cell.objects[1].id);
  EXPECT_EQ(bounds[0].name, cell.objects[1].name);
  EXPECT_EQ(bounds[0].force_N, 12.0);
  EXPECT_EQ(bounds[0].pose_error_m, 0.004);
  ASSERT_TRUE(bounds[0].X_WO);
  EXPECT_EQ(bounds[0].X_WO->translation_m, cell.objects[1].X_WO.translation_m);
  EXPECT_GT(bounds[0].box_O_m.sizes().minCoeff(), 0.01);
  EXPECT_LT(bounds[0].box_O_m.sizes().maxCoeff(), 2.0);
  cell.objects[1].loose = true;
  EXPECT_FALSE(object_bounds(cell)[0].X_WO) << "it may be anywhere";

  cell.objects.resize(kMaxBoundedObjects + 1, cell.objects[1]);
  for (auto& object : cell.objects) object.max_contact_force_N = 1.0;
  cell.objects.back().place = "cell.yaml:99: objects[33]";
  try {
    object_bounds(cell);
    ADD_FAILURE() << "too many";
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("cell.yaml:99: objects[33].max_contact_force_N"));
    EXPECT_THAT(error.what(), testing::HasSubstr("allowed: 32"));
  }
}

TEST(ForceBoundsOfACell, BoxesOfTheArmHoldItsSkin) {
  const ArmModel& model = shipped_arm();
  const LinkBoxes boxes = link_boxes(model.arm, model.skin, 0.005);
  const auto fine = robot::lay_out_skin(model.arm, model.skin, {.voxel_size_m = 0.005});
  ASSERT_TRUE(fine);
  for (std::size_t i = 0; i < fine->size(); ++i) {
    const Eigen::AlignedBox3d& box = boxes[fine->link_of(i)];
    ASSERT_LT(box.exteriorDistance(fine->position(i)), 0.02) << i;
  }
  robot::LinkSkin axis;
  axis.link = model.arm.links()[1].frames.front().first;
  axis.axes.push_back({.to_m = {0.0, 0.0, 0.4}, .radius_m = 0.08});
  const LinkBoxes slender = link_boxes(model.arm, {axis}, 0.005);
  EXPECT_GE(slender[1].sizes().minCoeff(), 0.16 - 1e-9) << "as thick as the link";
}

}  // namespace
}  // namespace phantom::slave_io
