#include "common/core/text.hpp"

#include <gmock/gmock.h>

namespace phantom::core {
namespace {

using testing::ElementsAre;

TEST(Text, IsFormattedAsByPrintfHoweverLongItIs) {
  EXPECT_EQ(formatted("%s has %d of %.3g %%", "it", 7, 1234.5), "it has 7 of 1.23e+03 %");
  const std::string longer(5000, 'x');
  EXPECT_EQ(formatted("<%s>", longer.c_str()), "<" + longer + ">");
  EXPECT_EQ(formatted("%s", ""), "");
}

TEST(Text, IsTrimmedAroundItAlone) {
  EXPECT_EQ(trimmed("\t a b \r\n"), "a b");
  EXPECT_EQ(trimmed("a"), "a");
  EXPECT_EQ(trimmed(" \t"), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(Text, GoesToLowerCaseInAsciiAlone) { EXPECT_EQ(lower_case("STL-Ä_1z"), "stl-Ä_1z"); }

TEST(Text, OfALineHasOneCellMoreThanCommas) {
  EXPECT_THAT(cells_of("t, q 1 ,,x\r"), ElementsAre("t", "q 1", "", "x"));
  EXPECT_THAT(cells_of(""), ElementsAre(""));
  EXPECT_THAT(cells_of("a,"), ElementsAre("a", ""));
}

TEST(Text, ListsItemsAsTheyAreAndByAName) {
  struct Item {
    std::string name;
  };
  EXPECT_EQ(listed(std::vector<Item>{{"a"}, {"b"}, {"c"}}, &Item::name), "a, b, c");
  EXPECT_EQ(listed(std::vector<std::string>{}), "");
  EXPECT_EQ(listed(std::vector<int>{1, 2}, [](int i) { return std::to_string(i); }), "1, 2");
}

}  // namespace
}  // namespace phantom::core
