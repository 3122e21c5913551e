#include "common/runtime/configuration/pose_text.hpp"

#include <gtest/gtest.h>

namespace phantom::wva_server {
namespace {

TEST(PoseText, IsSixNumbersThereAndBack) {
  const auto pose = runtime::parse_pose("0.1, -0.2 0.3 10 -20 130");
  ASSERT_TRUE(pose);
  EXPECT_EQ(runtime::pose_text(*pose), "0.1 -0.2 0.3 10 -20 130");
  for (const char* bad : {"", "1 2 3", "1 2 3 4 5 6 7", "1 2 3 4 5 x", "1 2 3 4 5 nan", "1e9 0 0 0 0 0"})
    EXPECT_FALSE(runtime::parse_pose(bad)) << bad;
}

}  // namespace
}  // namespace phantom::wva_server
