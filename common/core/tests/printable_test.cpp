#include "common/core/printable.hpp"

#include <gtest/gtest.h>

namespace phantom::core {
namespace {

TEST(Printable, WordsOfAnyLanguageStay) {
  for (const char* text : {"", "operator 2", "N·m → 90 °", "Prüfstand", "手术", "a\\b", "\xf0\x9f\x9b\x91"}) {
    EXPECT_TRUE(is_printable(text)) << text;
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, SR26_CharactersThatForgeOrHideTextAreEscaped) {
  EXPECT_EQ(printable("me\n12:00:00.000 info slave_io: reset by you"),
            "me\\n12:00:00.000 info slave_io: reset by you");
  EXPECT_EQ(printable("\x1b[2J\r\t\x7f"), "\\x1b[2J\\r\\t\\x7f");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\u202egnp.\u2066\u200b"), "\\u202egnp.\\u2066\\u200b");
  EXPECT_EQ(printable("\u0085\u2028\ufeff"), "\\u0085\\u2028\\ufeff");
  EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  for (const char* text : {"\n", "\x1b", "\u202e", "\xff", "\u0080"}) EXPECT_FALSE(is_printable(text));
}

}  // namespace
}  // namespace phantom::core
