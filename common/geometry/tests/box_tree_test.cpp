#include "common/geometry/box_tree.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <set>

#include "tests/support/heap_guard.hpp"

namespace phantom::geometry {
namespace {

/// Boxes of many sizes, some flat, some in one place.
std::vector<BoundingBox> some_boxes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-1, 1), size(0, 0.2F);
  std::vector<BoundingBox> boxes(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f corner = i % 7 == 0 ? Eigen::Vector3f::Constant(0.5F)
                                              : Eigen::Vector3f(place(random), place(random), place(random));
    boxes[i].extend(corner);
    boxes[i].extend(corner + Eigen::Vector3f(size(random), size(random), i % 5 == 0 ? 0.0F : size(random)));
  }
  return boxes;
}

double square_between(const BoundingBox& box, const Eigen::Vector3d& p) {
  return (box.min_m.cast<double>() - p).cwiseMax(p - box.max_m.cast<double>()).cwiseMax(0.0).squaredNorm();
}

TEST(BoxTree, HoldsEachItemOnceInTheBoxesAboveIt) {
  for (const std::size_t count : {0U, 1U, 4U, 5U, 333U}) {
    const auto boxes = some_boxes(count, 1);
    const BoxTree tree(boxes);
    EXPECT_EQ(std::set<std::uint32_t>(tree.items().begin(), tree.items().end()).size(), count);
    std::size_t visited = 0;
    std::vector<std::uint32_t> way;  // every node that was entered
    tree.walk([&](std::uint32_t node) { return way.push_back(node), true; },
              [&](std::uint32_t place) {
                ++visited;
                const BoxTree::Node &root = tree.nodes().front(), &leaf = tree.nodes()[way.back()];
                const BoundingBox& box = boxes[tree.items()[place]];
                for (const BoxTree::Node& node : {root, leaf}) {
                  EXPECT_TRUE((node.min <= box.min_m.array()).all());
                  EXPECT_TRUE((node.max >= box.max_m.array()).all());
                }
                EXPECT_LE(leaf.count, 4U);
              });
    EXPECT_EQ(visited, count);
    EXPECT_EQ(way.size(), tree.nodes().size());
  }
}

TEST(BoxTree, WalksOnlyWhereItIsToldTo) {
  const BoxTree tree(some_boxes(100, 2), 1);
  int visited = 0;
  tree.walk([](std::uint32_t node) { return node < 2; }, [&](std::uint32_t) { ++visited; });
  EXPECT_EQ(visited, 0);  // the root and its first child are no leaves
}

TEST(BoxTree, FindsTheNearest) {
  const auto boxes = some_boxes(500, 3);
  const BoxTree tree(boxes);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::size_t looked_at = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    double expected = INFINITY;
    for (const BoundingBox& box : boxes) expected = std::min(expected, square_between(box, p));
    double square = INFINITY;
    {
      const test::HeapGuard guard;
      tree.near(p, square, [&](std::uint32_t at) {
        ++looked_at;
        square = std::min(square, square_between(boxes[tree.items()[at]], p));
      });
    }
    EXPECT_EQ(square, expected);
    double limit = expected * 0.99;
    tree.near(p, limit,
              [&](std::uint32_t at) { EXPECT_GE(square_between(boxes[tree.items()[at]], p), expected); });
  }
  EXPECT_LT(looked_at, 300U * 500U / 5);  // it leaves most of them out
}

TEST(BoxTree, FindsWhatARayMeets) {
  const auto boxes = some_boxes(500, 5);
  const BoxTree tree(boxes);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  for (int i = 0; i < 300; ++i) {
    Eigen::Vector3d origin(place(random), place(random), place(random));
    Eigen::Vector3d direction = Eigen::Vector3d(place(random), place(random), place(random)).normalized();
    if (i % 3 == 0) {  // along an edge of a box, where 0 · ∞ lurks
      direction = Eigen::Vector3d::Unit(i % 9 / 3);
      origin = boxes[static_cast<std::size_t>(i)].min_m.cast<double>() - 0.5 * direction;
    }
    std::set<std::uint32_t> found;
    double to = 1.0;
    tree.along_ray(origin, direction, 0.1, to, [&](std::uint32_t at) { found.insert(tree.items()[at]); });
    for (std::uint32_t item = 0; item < boxes.size(); ++item) {
      // The box is met for certain if one of many points of the ray lies well inside.
      bool met = false;
      for (double s = 0.1; s <= 1.0 && !met; s += 0.004)
        met = square_between(boxes[item], origin + s * direction) == 0.0;
      if (met) {
        EXPECT_TRUE(found.contains(item)) << i;
      }
    }
    double none = 0.05;  // an empty stretch
    tree.along_ray(origin, direction, 0.1, none, [&](std::uint32_t) { ADD_FAILURE(); });
  }
}

TEST(BoxTree, GivesEachMeetingPairOnce) {
  const auto boxes = some_boxes(300, 7);
  const BoxTree tree(boxes);
  std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    for (std::uint32_t k = i + 1; k < boxes.size(); ++k)
      if (boxes[i].intersects(boxes[k])) expected.insert({i, k});
  std::size_t tested = 0;
  EXPECT_TRUE(tree.pairs([&](std::uint32_t place, std::uint32_t other) {
    ++tested;
    const auto [first, second] = std::minmax(tree.items()[place], tree.items()[other]);
    if (boxes[first].intersects(boxes[second])) {
      EXPECT_TRUE(found.insert({first, second}).second);
    }
    return true;
  }));
  EXPECT_EQ(found, expected);
  EXPECT_LT(tested, 300U * 299U / 4);
  std::size_t wanted = 10;
  EXPECT_FALSE(tree.pairs([&](std::uint32_t, std::uint32_t) { return --wanted > 0; }));
  EXPECT_EQ(wanted, 0U);
}

}  // namespace
}  // namespace phantom::geometry
