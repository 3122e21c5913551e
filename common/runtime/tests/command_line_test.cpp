#include "common/runtime/process/command_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"

namespace phantom::runtime {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A command line with an option of every kind.
struct Line {
  CommandLine line{"tool", "a tool", "tool 1"};
  double share = 0.5, gain = 1.0;
  int count = 1;
  std::string colour, taken;
  bool fast = false, used = false;
  std::vector<int> sizes;
  std::vector<std::string> names, places;
  Command move, copy;

  Line() {
    Command root = line.root();
    root.option("--share", share, "a share").between(0.0, 1.0);
    root.option("--gain", gain, "a gain").not_negative();
    root.option("--count", count, "a count").between(1, 9);
    root.option("--colour", colour, "a colour").one_of({"red", "blue"});
    root.option(
        "--take", [this](const std::string& text) { taken = text; }, "a text");
    root.option("--sizes", sizes, "sizes").separated_by(',');
    root.flag("--fast", fast, "be fast");
    move = root.subcommand("move", "move it");
    move.on_use([this] { used = true; });
    move.option("--name", names, "names").one_value_each_time();
    move.option("places", places, "places").required();
    copy = root.subcommand("copy", "copy it");
    root.require_subcommand(0, 1);
  }
  std::string refusal(const std::string& arguments) {
    try {
      line.parse(arguments);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
};

TEST(CommandLine, BindsVariablesAndKeepsWhatIsNotGiven) {
  Line it;
  it.line.parse("--share 0.25 --colour blue --take word --sizes 4,3,2");
  EXPECT_EQ(it.share, 0.25);
  EXPECT_EQ(it.count, 1);
  EXPECT_EQ(it.colour, "blue");
  EXPECT_EQ(it.taken, "word");
  EXPECT_THAT(it.sizes, ElementsAre(4, 3, 2));
  EXPECT_FALSE(it.fast);
  EXPECT_FALSE(it.move.given());
  EXPECT_FALSE(Command().given());
}

TEST(CommandLine, AnOptionOfTheWholeMayStandBehindTheSubcommand) {
  Line it;
  it.line.parse("move --name a b --name c d --fast");
  EXPECT_TRUE(it.move.given());
  EXPECT_FALSE(it.copy.given());
  EXPECT_TRUE(it.used);
  EXPECT_TRUE(it.fast);
  EXPECT_THAT(it.names, ElementsAre("a", "c"));
  EXPECT_THAT(it.places, ElementsAre("b", "d"));
}

TEST(CommandLine, SaysWhatIsAllowed) {
  for (const char* wrong : {"--share 1.5", "--share -0.1", "--share nan", "--share x"})
    EXPECT_THAT(Line().refusal(wrong), HasSubstr("--share")) << wrong;
  for (const char* wrong : {"--gain -1", "--gain nan"})
    EXPECT_THAT(Line().refusal(wrong), HasSubstr("--gain")) << wrong;
  EXPECT_EQ(Line().refusal("--gain 1e9"), "accepted");
  EXPECT_THAT(Line().refusal("--count 10"),
              testing::AnyOf(HasSubstr("range 1 to 9"), HasSubstr("range [1 - 9]")));
  EXPECT_THAT(Line().refusal("--count 1.5"), HasSubstr("--count"));
  EXPECT_THAT(Line().refusal("--colour green"), HasSubstr("{red,blue}"));
  EXPECT_THAT(Line().refusal("move"), HasSubstr("places is required"));
  EXPECT_THAT(Line().refusal("--unknown"), HasSubstr("--unknown"));
  EXPECT_NE(Line().refusal("move a copy --name"), "accepted");
}

TEST(CommandLine, DistinguishesHelpFromErrors) {
  const char* help[] = {"tool", "--help"};
  const char* wrong[] = {"tool", "--count", "10"};
  const char* fine[] = {"tool", "--count", "9"};
  EXPECT_EQ(Line().line.parse(2, help), std::optional(false));
  EXPECT_EQ(Line().line.parse(3, wrong), std::optional(true));
  EXPECT_EQ(Line().line.parse(3, fine), std::nullopt);
}

TEST(CommandLine, ANumberIsAWholeText) {
  EXPECT_EQ(number_of("-2.5e3"), -2500.0);
  EXPECT_EQ(number_of("2 m"), std::nullopt);
  EXPECT_EQ(number_of(""), std::nullopt);
}

}  // namespace
}  // namespace phantom::runtime
