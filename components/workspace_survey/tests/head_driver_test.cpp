#include "components/workspace_survey/head/head_driver.hpp"

#include <sys/types.h>

#include <csignal>
#include <fstream>

#include "components/workspace_survey/tests/rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Drivers as lines of shell.
class HeadDriverTest : public InFolder {
 protected:
  HeadDriverTest() {
    std::signal(SIGPIPE, SIG_IGN);  // as in every process of ours
    head_.min_range_m = 0.5;
    head_.max_range_m = 10.0;
  }
  static std::string describe() {
    return R"(echo '{"id":1,"contract":1,"driver":"shell","pan_rad":[-1,1],"tilt_rad":[0,3]}')";
  }
  /// A driver that describes itself, and answers aims and measures by these commands.
  static std::string driver(const std::string& aim, const std::string& measure = "true") {
    return "while read -r line; do case \"$line\" in *describe*) " + describe() + ";; *aim*) " + aim +
           ";; *measure*) " + measure + ";; esac; done";
  }
  std::string start(const std::string& command, double timeout_s = 10.0) const {
    return refusal([&] { const HeadDriver started(command, head_, timeout_s); });
  }

  survey::RangeHead head_;
};

constexpr const char* kStands = R"(echo '{"id":2,"pan_rad":0.1,"tilt_rad":0.2}')";

TEST_F(HeadDriverTest, AimsAndMeasures) {
  HeadDriver head(
      driver(kStands, R"(echo; echo '{"id":3,"readings":[{"range_m":3.5,"pan_rad":0.1,"tilt_rad":0.2}]}')"),
      head_, 10.0);
  EXPECT_EQ(head.description().driver, "shell");
  EXPECT_THAT(head.measure(1).status().message(), HasSubstr("not aimed yet"));
  const auto stands = head.aim(0.1, 0.2);
  ASSERT_TRUE(stands) << stands.status().message();
  EXPECT_EQ(stands->tilt_rad, 0.2);
  const auto readings = head.measure(1);
  ASSERT_TRUE(readings) << readings.status().message();
  EXPECT_EQ(readings->front().range_m, 3.5);
}

// Tries workspace_survey: the head's driver does not start; is silent; ends; answers what is not allowed
TEST_F(HeadDriverTest, ADriverThatDoesNotStartOrAnswerIsNamed) {
  EXPECT_THAT(start("exit 7"),
              AllOf(HasSubstr("head driver 'exit 7': describe: has ended with exit code 7")));
  EXPECT_THAT(start("no_such_driver 2> /dev/null"), HasSubstr("has ended with exit code 127"));
  EXPECT_THAT(start("exec sleep 60", 0.2), HasSubstr("describe: does not answer for 0.2 s"));
  EXPECT_THAT(start("while read -r line; do echo hello; done"), HasSubstr("'hello' is no JSON object"));
  EXPECT_THAT(start("read -r line; echo '{\"id\":1,\"contract\":9}'"),
              HasSubstr("contract is missing or another"));
  EXPECT_THAT(start("read -r line; echo '{\"id\":2}'; read -r line"), HasSubstr("id is 2; allowed: 1"));
  EXPECT_THAT(start("yes x | tr -d '\\n'"), HasSubstr("a line is too long; allowed: 65536 bytes"));
  EXPECT_THAT(start("kill -9 $$"), HasSubstr("has ended by signal 9"));
}

TEST_F(HeadDriverTest, ErrorsOfACallAreNamedAndTheNextCallGoesOn) {
  HeadDriver head(
      driver(R"(case "$line" in *'"id":2'*) echo '{"id":2,"error":"stalled"}';; *'"id":3'*) echo )"
             R"('{"id":3,"pan_rad":0.5,"tilt_rad":0.2}';; *) echo '{"id":4,"pan_rad":0.1,"tilt_rad":0.2}';; )"
             R"(esac)",
             "exit 5"),
      head_, 10.0);
  EXPECT_THAT(head.aim(0.1, 0.2).status().message(), HasSubstr("': aim: stalled"));
  EXPECT_THAT(head.aim(0.1, 0.2).status().message(), HasSubstr("aim: pan_rad is 0.50000; allowed: within"));
  EXPECT_TRUE(head.aim(0.1, 0.2));
  EXPECT_THAT(head.measure(1).status().message(), HasSubstr("measure: has ended with exit code 5"));
  EXPECT_THAT(head.aim(0.1, 0.2).status().message(), HasSubstr("aim: has ended"));
}

TEST_F(HeadDriverTest, AReplyThatComesTooLateIsNotTakenForAnothers) {
  HeadDriver head(
      driver(R"(case "$line" in *'"id":2'*) sleep 0.6; echo '{"id":2,"pan_rad":0.1,"tilt_rad":0.2}';; )"
             R"(*) echo '{"id":3,"pan_rad":0.7,"tilt_rad":0.2}';; esac)"),
      head_, 0.5);
  EXPECT_THAT(head.aim(0.1, 0.2).status().message(), HasSubstr("does not answer for 0.5 s"));
  const auto stands = head.aim(0.7, 0.2);
  ASSERT_TRUE(stands) << stands.status().message();
  EXPECT_EQ(stands->pan_rad, 0.7);
}

TEST_F(HeadDriverTest, WhatADriverStartedEndsWithIt) {
  const auto pid_file = folder_ / "pid";
  {
    const HeadDriver head("sleep 1000 > /dev/null & echo $! > " + pid_file.string() + "; " + driver(kStands),
                          head_, 10.0);
  }
  pid_t process = 0;
  std::ifstream(pid_file) >> process;
  ASSERT_GT(process, 1);
  EXPECT_TRUE(test::eventually([&] {
    // A zombie that nobody reaps here counts as ended.
    std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
    std::string id, name, state;
    return !(stat >> id >> name >> state) || state == "Z";
  }));
}

}  // namespace
}  // namespace phantom::workspace_survey
