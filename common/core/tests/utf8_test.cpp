#include "common/core/utf8.hpp"

#include <gtest/gtest.h>

namespace phantom::core {
namespace {

TEST(Utf8, ACutTextIsTheLongestThatEndsAtACharacter) {
  const std::string text = "aä€😀b";  // 1, 2, 3, 4 and 1 bytes
  for (std::size_t most = 0; most <= text.size() + 1; ++most) {
    const std::string cut = cut_to_bytes(text, most);
    EXPECT_TRUE(text.starts_with(cut)) << most;
    EXPECT_TRUE(is_utf8(cut)) << most;
    std::size_t longest = std::min(most, text.size());
    while (!is_utf8(text.substr(0, longest))) --longest;
    EXPECT_EQ(cut.size(), longest) << most;
  }
}

TEST(Utf8, ColumnsAreCharacters) {
  EXPECT_EQ(columns_of("aä€😀b"), 5U);
  EXPECT_EQ(cut_to_columns("aä€😀b", 3), "aä€");
  EXPECT_EQ(cut_to_columns("aä€", 3), "aä€");
  EXPECT_EQ(cut_to_columns("aä€", 0), "");
  EXPECT_EQ(cut_to_columns("μm and more", 2), "μm");
  EXPECT_EQ(cut_to_columns("short", 80), "short");
}

}  // namespace
}  // namespace phantom::core
