#include "common/core/file_sync.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>

#include "tests/support/files.hpp"

namespace phantom::core {
namespace {

TEST(FileSync, BringsAFilesFolderToTheDisk) {
  const auto file = test::new_folder() / "kept";
  std::ofstream(file) << "x";
  EXPECT_TRUE(sync_folder_of(file));
}

TEST(FileSync, SaysWhyItCannot) {
  errno = 0;
  EXPECT_FALSE(sync_folder_of(test::new_folder() / "nowhere" / "kept"));
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace phantom::core
