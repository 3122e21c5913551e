// Nobody reads standard error, and the pipe is full: whoever publishes or serves goes on, and ends in time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <mutex>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::processes {
namespace {

using phantom::test::eventually;

class FullStderr : public testing::Test {
 protected:
  FullStderr()
      : folder_(test::new_folder()),
        network_{.domain = test::own_domain(),
                 .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                 .interfaces = {"127.0.0.1"}},
        participant_("full_stderr_test", network_),
        slaves_(participant_, dds::kSlaveState,
                [this](const msg::SlaveState& state, const dds::SampleInfo&) {
                  const std::lock_guard lock(mutex_);
                  slave_ = state;
                  ++slave_states_;
                }),
        masters_(participant_, dds::kMasterState,
                 [this](const msg::MasterState& state, const dds::SampleInfo&) {
                   const std::lock_guard lock(mutex_);
                   master_ = state;
                   ++master_states_;
                 }) {}

  RunningProcess::Options options(int output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"--deployment", write_topology(folder_).string(), "--domain",
                                       std::to_string(network_.domain)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return {.arguments = arguments, .environment = {}, .output = output};
  }
  bool coupled() {
    const std::lock_guard lock(mutex_);
    return slave_ && master_ && slave_->state() == msg::LinkState::LINK_COUPLED &&
           master_->state() == msg::LinkState::LINK_COUPLED;
  }
  int states(const int& which) {
    const std::lock_guard lock(mutex_);
    return which;
  }

  std::filesystem::path folder_;
  core::NetworkOptions network_;
  std::mutex mutex_;
  std::optional<msg::SlaveState> slave_;
  std::optional<msg::MasterState> master_;
  int slave_states_ = 0, master_states_ = 0;
  FullPipe nobody_reads_;
  dds::Participant participant_;
  dds::Reader<msg::SlaveState> slaves_;
  dds::Reader<msg::MasterState> masters_;
};

// On their way to COUPLED both say how their link's state changes, from the thread that publishes.
TEST_F(FullStderr, MasterAndSlaveCoupleGoOnPublishingAndEndInTime) {
  RunningProcess slave("slave_io", options(nobody_reads_.writer()), folder_);
  RunningProcess master("master_io", options(nobody_reads_.writer()), folder_);
  ASSERT_TRUE(eventually([&] { return coupled(); }));
  const int slave_before = states(slave_states_), master_before = states(master_states_);
  EXPECT_TRUE(eventually([&] {
    return states(slave_states_) > slave_before + 500 && states(master_states_) > master_before + 500;
  }));
  for (RunningProcess* process : {&slave, &master}) {
    const Duration took = process->end(SIGTERM);
    EXPECT_EQ(process->exit_code(), 0);
    EXPECT_LE(took.own_s(), 1.0) << "of " << took.wall_s << " s";
  }
}

TEST_F(FullStderr, AnErrorEndsAProcessInTimeToo) {
  RunningProcess slave("slave_io", options(nobody_reads_.writer(), {"--config", "/nonexistent.yaml"}),
                       folder_);
  EXPECT_TRUE(eventually([&] { return !slave.running(); })) << "it waits for a reader of its error";
  EXPECT_EQ(slave.exit_code(), 3);
}

// Tries dds_spy: the reader of its output goes away
TEST_F(FullStderr, ASpyWhoseOutputNobodyReadsAnyMoreEnds) {
  RunningProcess slave("slave_io", options(nobody_reads_.writer()), folder_);
  const auto code = folder_ / "code";
  const test::Said said =
      test::run_line("{ timeout 300 " PHANTOM_BIN_DIR "/dds_spy echo slave_state --deployment " +
                     write_topology(folder_).string() + " --domain " + std::to_string(network_.domain) +
                     "; echo $? > " + code.string() + "; } | head -n 1");
  EXPECT_THAT(said.output, testing::HasSubstr("slave_state"));
  EXPECT_NE(test::text_of(code), "124\n") << "it was ended by its time limit";
}

TEST_F(FullStderr, WhereSomebodyReadsTheReasonOfTheEndIsTheLastLine) {
  RunningProcess slave("slave_io", options(-1, {"--report-dir", "/nonexistent/folder"}), folder_);
  ASSERT_TRUE(eventually([&] { return states(slave_states_) > 10; })) << slave.log();
  slave.end(SIGTERM);
  EXPECT_EQ(slave.exit_code(), 1) << "its report cannot be written";
  const std::string log = slave.log();
  const auto info = log.find(" slave_io: the bodies stand after ");
  const auto error = log.find("\nslave_io: /nonexistent/folder/slave_io.json: cannot be written\n");
  ASSERT_NE(info, std::string::npos) << log;
  ASSERT_NE(error, std::string::npos) << log;
  EXPECT_LT(info, error) << "lines come in the order in which they were said";
  EXPECT_EQ(log.find('\n', error + 1), log.size() - 1) << "nothing comes after it: " << log;
}

}  // namespace
}  // namespace phantom::processes
