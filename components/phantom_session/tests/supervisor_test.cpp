#include "components/phantom_session/supervisor.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>

#include "common/core/errors.hpp"
#include "tests/support/files.hpp"

namespace phantom::phantom_session {
namespace {

class SupervisorTest : public testing::Test {
 protected:
  ProcessSpec shell(const std::string& name, const std::string& script) {
    return {name, "/bin/sh", {"-c", script}, 0, folder_ / (name + ".log")};
  }
  // Waits until a process ended by itself.
  std::vector<ProcessOutcome> await_death(Supervisor& supervisor) {
    for (;;) {
      auto dead = supervisor.newly_dead();
      if (!dead.empty()) return dead;
      usleep(1000);
    }
  }
  const std::filesystem::path folder_ = test::new_folder();
};

// Tries phantom_session: a component ends unasked
TEST_F(SupervisorTest, TellsOnceWhoDiedWithWhatCodeAndKeepsItsWords) {
  Supervisor supervisor;
  supervisor.start(shell("dies", "echo one; echo out of memory >&2; exit 3"));
  const auto dead = await_death(supervisor);
  ASSERT_EQ(dead.size(), 1u);
  EXPECT_EQ(dead[0].exit_code, 3);
  EXPECT_FALSE(dead[0].ended_by_us);
  EXPECT_TRUE(supervisor.newly_dead().empty());
  EXPECT_EQ(last_lines(folder_ / "dies.log", 1), "    out of memory\n");
}

TEST_F(SupervisorTest, ASignalIsToldAs128PlusItsNumber) {
  Supervisor supervisor;
  supervisor.start(shell("crashes", "kill -SEGV $$"));
  EXPECT_EQ(await_death(supervisor)[0].exit_code, 128 + SIGSEGV);
}

// Tries phantom_session: a component does not end in order
TEST_F(SupervisorTest, EndsTheWillingWithTermAndTheUnwillingWithKill) {
  Supervisor supervisor;
  supervisor.start(shell(
      "willing", "trap 'exit 0' TERM; touch " + (folder_ / "a").string() + "; while :; do sleep 0.01; done"));
  supervisor.start(shell(
      "unwilling", "trap '' TERM; touch " + (folder_ / "b").string() + "; while :; do sleep 0.01; done"));
  while (!std::filesystem::exists(folder_ / "a") || !std::filesystem::exists(folder_ / "b")) usleep(1000);
  supervisor.stop_all(0.5);
  const auto outcomes = supervisor.outcomes();
  EXPECT_EQ(outcomes[0].exit_code, 0);
  EXPECT_EQ(outcomes[1].exit_code, 128 + SIGKILL);
  EXPECT_TRUE(outcomes[0].ended_by_us);
  EXPECT_TRUE(supervisor.newly_dead().empty()) << "asked to end: no accident";
}

// Told to end before it has become another program: this program's handler must not take the signal from it.
TEST_F(SupervisorTest, EndsWhoHasOnlyJustBeenStarted) {
  const auto before = std::signal(SIGTERM, [](int) {});
  for (int round = 0; round < 20; ++round) {
    Supervisor supervisor;
    for (int i = 0; i < 5; ++i)
      supervisor.start({"sleeper", "/bin/sleep", {"600"}, 0, folder_ / "sleeper.log"});
    supervisor.stop_all(60.0);
    for (const ProcessOutcome& outcome : supervisor.outcomes()) ASSERT_EQ(outcome.exit_code, 128 + SIGTERM);
  }
  std::signal(SIGTERM, before);
}

// Tries phantom_session: an executable is missing
TEST_F(SupervisorTest, AMissingExecutableIsNamed) {
  Supervisor supervisor;
  EXPECT_THROW(supervisor.start({"x", "/nowhere/x", {}, 0, folder_ / "x.log"}), core::MissingError);
}

}  // namespace
}  // namespace phantom::phantom_session
