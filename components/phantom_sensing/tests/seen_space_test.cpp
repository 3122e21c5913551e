// Which space depth cameras have not seen, by the cubes that they tell of.
#include "components/phantom_sensing/seen_space.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace phantom::phantom_sensing::seen_space_test {
namespace {

using core::kNsPerSecond;

constexpr core::Nanoseconds kNow_ns = 100 * kNsPerSecond;

/// 4 × 3 × 2 cubes of 0.5 m; each has its number as age.
messages::SpaceView numbered() {
  messages::SpaceView view;
  view.origin_m = {-1.0, 0.0, 1.0};
  view.cube_m = 0.5;
  view.size_x = 4, view.size_y = 3, view.size_z = 2;
  for (std::uint8_t i = 0; i < 24; ++i) view.ages.push_back(i);
  return view;
}

TEST(SeenSpace, EachPlaceHasTheAgeOfItsCube) {
  const SeenSpace seen(numbered(), kNow_ns);
  for (int z = 0; z < 2; ++z) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 4; ++x) {
        const double age_s = 0.25 * (x + 4 * (y + 3 * z));
        const Eigen::Vector3d low{-1.0 + 0.5 * x, 0.5 * y, 1.0 + 0.5 * z};
        for (const double inside_m : {0.001, 0.25, 0.499}) {
          const Eigen::Vector3d place = low + Eigen::Vector3d::Constant(inside_m);
          EXPECT_FALSE(seen.is_unseen(place, age_s + 0.01, kNow_ns)) << place.transpose();
          EXPECT_TRUE(seen.is_unseen(place, age_s - 0.01, kNow_ns)) << place.transpose();
        }
      }
    }
  }
}

TEST(SeenSpace, AgesGrowWhileNothingComes) {
  const SeenSpace seen(numbered(), kNow_ns);
  const Eigen::Vector3d place{-0.9, 0.1, 1.1};
  EXPECT_FALSE(seen.is_unseen(place, 3.0, kNow_ns + 2'900'000'000));
  EXPECT_TRUE(seen.is_unseen(place, 3.0, kNow_ns + 3'100'000'000));
}

TEST(SeenSpace, WhatWasNeverSeenOrLongAgoIsUnseenWhateverTheLimit) {
  messages::SpaceView view = numbered();
  view.ages[0] = messages::kSpaceNeverSeen;
  view.ages[1] = messages::kSpaceAgeMax;
  const SeenSpace seen(view, kNow_ns);
  EXPECT_TRUE(seen.is_unseen({-0.9, 0.1, 1.1}, 63.0, kNow_ns));
  EXPECT_TRUE(seen.is_unseen({-0.4, 0.1, 1.1}, 63.0, kNow_ns));
}

TEST(SeenSpace, NothingIsUnseenOutsideOrWhereNoCameraWatches) {
  const SeenSpace none;
  EXPECT_FALSE(none.is_unseen({0.0, 0.0, 0.0}, 3.0, kNow_ns));
  messages::SpaceView view = numbered();
  view.ages.assign(24, messages::kSpaceNeverSeen);
  const SeenSpace seen(view, kNow_ns);
  for (const Eigen::Vector3d& outside :
       {Eigen::Vector3d(-1.01, 0.1, 1.1), Eigen::Vector3d(1.01, 0.1, 1.1), Eigen::Vector3d(0.0, -0.01, 1.1),
        Eigen::Vector3d(0.0, 1.51, 1.1), Eigen::Vector3d(0.0, 0.1, 0.99), Eigen::Vector3d(0.0, 0.1, 2.01),
        Eigen::Vector3d(std::nan(""), 0.1, 1.1), Eigen::Vector3d(1e300, 0.1, 1.1)})
    EXPECT_FALSE(seen.is_unseen(outside, 3.0, kNow_ns)) << outside.transpose();
}

TEST(UnseenSpaceWatch, ItIsSaidAtOnceAndForASecondAfter) {
  UnseenSpaceWatch watch;
  EXPECT_FALSE(watch.step(false, kNow_ns));
  EXPECT_TRUE(watch.step(true, kNow_ns));
  EXPECT_TRUE(watch.step(false, kNow_ns + kNsPerSecond - 1));
  EXPECT_FALSE(watch.step(false, kNow_ns + kNsPerSecond));
}

}  // namespace
}  // namespace phantom::phantom_sensing::seen_space_test
