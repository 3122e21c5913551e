#include "components/phantom_sensing/gradient_cache.hpp"

#include <gtest/gtest.h>

namespace phantom::phantom_sensing {
namespace {

workspace::Workspace some_workspace() {
  return {{Eigen::Vector3d::Zero(), 0.005, {64, 64, 64}}, {0.0F, 1.0F}};
}

TEST(GradientCache, KnowsWhatWasPutForAVoxelAndNothingElse) {
  const workspace::Workspace voxels = some_workspace();
  GradientCache cache;
  cache.follow(voxels);
  EXPECT_EQ(cache.find({0, 0, 0}), nullptr) << "not that of an empty place";
  cache.put({3, 4, 5}, {1.0, 2.0, 3.0});
  ASSERT_NE(cache.find({3, 4, 5}), nullptr);
  EXPECT_EQ(*cache.find({3, 4, 5}), Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(cache.find({3, 4, 6}), nullptr);
  EXPECT_EQ(cache.find({35, 4, 5}), nullptr) << "it has the same place";
  cache.put({35, 4, 5}, Eigen::Vector3d::Zero());
  EXPECT_NE(cache.find({35, 4, 5}), nullptr);
  EXPECT_EQ(cache.find({3, 4, 5}), nullptr) << "the newer one stays";
  cache.put({-1, -1, -1}, Eigen::Vector3d::Ones());
  EXPECT_NE(cache.find({-1, -1, -1}), nullptr);
}

TEST(GradientCache, ForgetsWithEachVersionOfTheWorkspace) {
  workspace::Workspace voxels = some_workspace();
  GradientCache cache;
  cache.follow(voxels);
  cache.put({3, 4, 5}, Eigen::Vector3d::Ones());
  cache.follow(voxels);
  EXPECT_NE(cache.find({3, 4, 5}), nullptr);
  voxels.version = 2;
  cache.follow(voxels);
  EXPECT_EQ(cache.find({3, 4, 5}), nullptr);
  cache.put({3, 4, 5}, Eigen::Vector3d::Ones());
  const workspace::Workspace other = some_workspace();
  cache.follow(other);
  EXPECT_EQ(cache.find({3, 4, 5}), nullptr);
}

}  // namespace
}  // namespace phantom::phantom_sensing
