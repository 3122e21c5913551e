#include "common/geometry/mesh/weld.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace phantom::geometry {
namespace {

TEST(Weld, EqualPointsAreOnePlace) {
  const std::vector<Eigen::Vector3f> points = {{1, 2, 3}, {0, 0, 0}, {1, 2, 3}, {-0.0F, 0, -0.0F}, {3, 2, 1}};
  EXPECT_EQ(weld(points), (std::vector<std::uint32_t>{0, 1, 0, 1, 4}));
  EXPECT_TRUE(weld(std::vector<Eigen::Vector3f>{}).empty());
  const std::vector<Eigen::Vector3f> no_numbers(3, Eigen::Vector3f::Constant(NAN));
  EXPECT_EQ(weld(no_numbers), (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(Weld, WholeNumbersToo) {
  using Point = std::array<std::int32_t, 4>;
  EXPECT_EQ(weld(std::vector<Point>{{1, 2, 3, 0}, {-1, 2, 3, 0}, {1, 2, 3, 0}}),
            (std::vector<std::uint32_t>{0, 1, 0}));
}

TEST(Weld, ManyPointsAsByComparingAll) {
  std::mt19937 random(1);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 2000; ++i)
    points.emplace_back(static_cast<float>(random() % 10), static_cast<float>(random() % 10),
                        static_cast<float>(random() % 10));
  const auto first = weld(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto found = std::find(points.begin(), points.end(), points[i]) - points.begin();
    EXPECT_EQ(first[i], static_cast<std::uint32_t>(found));
  }
}

TEST(Weld, PlacesAreNumberedAsTheyAppear) {
  std::vector<Eigen::Vector3f> distinct;
  Places<Eigen::Vector3f> places(distinct);
  for (const float x : {5.0F, 3.0F, 5.0F, 4.0F}) places.number_of({x, 0, 0});
  ASSERT_EQ(distinct.size(), 3U);
  EXPECT_EQ(distinct[1].x(), 3.0F);
  EXPECT_EQ(places.number_of({4, 0, 0}), 2U);
}

TEST(Weld, WithinATolerance) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0},    {0.09, 0, 0}, {0.11, 0, 0},
                                               {0.19, 0, 0}, {0, 0, 5},    {0, 0.05, 5.05}};
  // 0.11 is too far from the first, stands for itself, and is nearer to 0.19.
  EXPECT_EQ(weld(points, 0.1), (std::vector<std::uint32_t>{0, 0, 2, 2, 4, 4}));
}

TEST(PointGrid, FindsTheNearestAsByComparingAll) {
  constexpr double kRadius = 0.1;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-1, 1);
  const auto point = [&] { return Eigen::Vector3d(place(random), place(random), place(random)); };
  PointGrid grid(kRadius);
  std::vector<Eigen::Vector3d> points;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    points.push_back(point());
    grid.add(points.back(), i);
  }
  int found_some = 0;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p = point();
    std::size_t best = 0;
    for (std::size_t k = 1; k < points.size(); ++k)
      if ((points[k] - p).squaredNorm() < (points[best] - p).squaredNorm()) best = k;
    const auto near = grid.nearest(p);
    ASSERT_EQ(near.has_value(), (points[best] - p).norm() <= kRadius);
    if (!near) continue;
    ++found_some;
    EXPECT_EQ(near->index, best);
    EXPECT_EQ(near->square_m2, (points[best] - p).squaredNorm());
  }
  EXPECT_GT(found_some, 100);
}

TEST(PointGrid, OfTwoAsNearTheOneOfTheLowerIndex) {
  PointGrid grid(1.0);
  grid.add({1, 0, 0}, 7);
  grid.add({-1, 0, 0}, 3);
  ASSERT_TRUE(grid.nearest({0, 0, 0}));
  EXPECT_EQ(grid.nearest({0, 0, 0})->index, 3U);
}

}  // namespace
}  // namespace phantom::geometry
