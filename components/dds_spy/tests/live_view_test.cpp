#include "components/dds_spy/live_view.hpp"

#include <gtest/gtest.h>

#include "common/core/utf8.hpp"
#include "components/dds_spy/line_queue.hpp"
#include "components/dds_spy/table.hpp"
#include "components/dds_spy/terminal.hpp"

namespace phantom::dds_spy {
namespace {

void type(LiveView& view, const std::string& keys) {
  for (const char key : keys) view.press(key);
}

TEST(LiveView, KeysSwitchPagesRoundAndRound) {
  LiveView view;
  EXPECT_EQ(view.page(), Page::kRates);
  type(view, "3");
  EXPECT_EQ(view.page(), Page::kEvents);
  view.press(kRight);
  EXPECT_EQ(view.page(), Page::kTopology);
  type(view, "1");
  view.press(kLeft);
  EXPECT_EQ(view.page(), Page::kHelp);
  type(view, "\t");
  EXPECT_EQ(view.page(), Page::kRates);
  type(view, " ");
  EXPECT_TRUE(view.paused());
  type(view, "r");
  EXPECT_TRUE(view.take_reset());
  EXPECT_FALSE(view.take_reset());
  EXPECT_FALSE(view.quit());
  type(view, "q");
  EXPECT_TRUE(view.quit());
}

TEST(LiveView, AFilterIsTypedCorrectedTakenAndDropped) {
  LiveView view;
  type(view, "/stqx\x7f\x7f");
  EXPECT_TRUE(view.filter().keeps("percept")) << "not before Enter";
  type(view, "ate !master\n");
  EXPECT_FALSE(view.quit()) << "q was text";
  EXPECT_TRUE(view.filter().keeps("slave_state"));
  EXPECT_FALSE(view.filter().keeps("master_state"));
  EXPECT_FALSE(view.filter().keeps("percept"));
  view.press(kEscape);
  EXPECT_TRUE(view.filter().keeps("percept"));
  type(view, "/[ms]*_state\n");
  EXPECT_TRUE(view.filter().keeps("master_state"));
  EXPECT_FALSE(view.filter().keeps("x_state"));
}

TEST(LiveView, TheScreenIsExactlyAsLargeAsTheTerminal) {
  LiveView view;
  std::string body;
  for (int i = 0; i < 50; ++i) body += "µ line " + std::to_string(i) + "\n";
  const auto screen = view.screen("title", body, 20, 12);
  ASSERT_EQ(screen.size(), 12u);
  for (const auto& line : screen) EXPECT_LE(core::columns_of(line), 20u);
  EXPECT_EQ(screen[1], "µ line 0");
  EXPECT_EQ(screen[10], "µ line 9");
  for (int i = 0; i < 3; ++i) view.press(kDown);
  EXPECT_EQ(view.screen("title", body, 80, 12)[1], "µ line 3");
  for (int i = 0; i < 30; ++i) view.press(kPageDown);
  EXPECT_EQ(view.screen("title", body, 80, 12)[10], "µ line 49") << "the end stays at the bottom";
  view.press(kUp);
  EXPECT_EQ(view.screen("title", body, 80, 12)[10], "µ line 48");
  EXPECT_EQ(view.screen("title", "short\n", 80, 12)[1], "short");
  for (std::size_t rows : {0U, 1U, 2U}) EXPECT_EQ(view.screen("t", body, 80, rows).size(), rows);
}

TEST(Terminal, EscapeSequencesAreOneKey) {
  EXPECT_EQ(decode_keys("a\x1b[A\x1b[6~\x1b"), (std::vector<int>{'a', kUp, kPageDown, kEscape}));
}

TEST(Table, ColumnsAreAsWideAsTheirWidestCell) {
  Table table({"NAME", ">N/µs", "NOTE"});
  table.add({"a", "1", ""});
  table.add({"größe", "1000000", "x"});
  EXPECT_EQ(table.text(), "NAME      N/µs  NOTE\na            1\ngröße  1000000  x\n");
}

TEST(LineQueue, IsBoundedAndCountsWhatItDrops) {
  LineQueue queue(2, 1000);
  for (const char* text : {"a", "b", "c"}) queue.put(text);
  EXPECT_EQ(queue.take(), (std::deque<std::string>{"a", "b"}));
  EXPECT_EQ(queue.dropped(), 1u);
  queue.put("d");
  EXPECT_EQ(queue.take().size(), 1u);
}

TEST(LineQueue, LargeTextsFillItSooner) {
  LineQueue queue(100, 1000);
  for (int i = 0; i < 20; ++i) queue.put(std::string(300, 'x'));
  queue.put("short");
  EXPECT_EQ(queue.dropped(), 17u);
  EXPECT_EQ(queue.take().size(), 4u);
  queue.put(std::string(1000, 'x'));
  EXPECT_EQ(queue.take().size(), 1u) << "there is room again";
}

}  // namespace
}  // namespace phantom::dds_spy
