// `phantom_sensing command`: what it says, and what a running component makes of it.
#include "components/phantom_sensing/command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <sstream>
#include <thread>

#include "common/core/errors.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing {
namespace {

using testing::HasSubstr;

/// The part of a running component that answers, on a thread of its own.
class Answering {
 public:
  explicit Answering(const core::NetworkOptions& network)
      : adapter_(network, model_), loop_(model_, config_, keeper_, adapter_), contacts_(model_.arm) {
    contacts_.know_objects({{1, "wall"}, {2, "vice"}});
    adapter_.start_reading(loop_, keeper_);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        adapter_.handle_commands([this](const messages::SensingCommand& command) -> Answer {
          if (command.request == messages::SensingRequest::kSelfTest)
            return {sound.load(), sound ? "self-test passed" : "self-test failed: a layer"};
          if (command.request == messages::SensingRequest::kListContacts)
            return contacts_.list(core::monotonic_ns());
          return contacts_.handle(command, core::monotonic_ns());
        });
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  ~Answering() {
    thread_.request_stop();
    thread_.join();
    adapter_.stop_reading();
  }
  std::string tip() const { return model_.arm.links().back().name; }
  std::atomic<bool> sound{true};

 private:
  PhantomModel model_ = rig::suspended_model();
  Config config_;
  DdsAdapter adapter_;
  WorkspaceSubscriber keeper_{{[](const std::string&) {}}};
  SensingLoop loop_;
  ContactRegister contacts_;
  std::jthread thread_;
};

struct Printed {
  int code;
  std::string text;
};

Printed run(const CommandRequest& request, const core::NetworkOptions& network) {
  std::ostringstream print;
  const int code = run_command(request, network, print);
  return {code, print.str()};
}

TEST(Command, AllowsListsForbidsAndTests) {
  const core::NetworkOptions network = dds::test_network();
  Answering component(network);
  const std::string tip = component.tip();
  Printed printed = run({.what = "list"}, network);
  EXPECT_EQ(printed.code, runtime::kExitDone);
  EXPECT_EQ(printed.text, "done: no contact is allowed\n");
  printed = run({.what = "allow", .object = "vice", .link = tip}, network);
  EXPECT_EQ(printed.code, runtime::kExitDone);
  EXPECT_EQ(printed.text, "done: contact allowed: vice by " + tip + "\n");
  EXPECT_EQ(run({.what = "allow", .id = 1, .duration_s = 3600.0}, network).text,
            "done: contact allowed: wall by the whole arm for 3600 s\n");
  printed = run({.what = "list"}, network);
  EXPECT_THAT(printed.text, HasSubstr("done: allowed: vice by " + tip + ", wall by the whole arm for 3"));
  EXPECT_EQ(run({.what = "forbid", .object = "vice", .link = tip}, network).code, runtime::kExitDone);
  EXPECT_EQ(run({.what = "forbid", .all = true}, network).text,
            "done: all contact is felt again (1 had been allowed)\n");

  printed = run({.what = "allow", .object = "vise"}, network);
  EXPECT_EQ(printed.code, runtime::kExitFailed);
  EXPECT_EQ(printed.text, "refused: no object is called 'vise'; allowed: wall, vice\n");

  EXPECT_EQ(run({.what = "self-test"}, network).text, "done: self-test passed\n");
  component.sound = false;
  printed = run({.what = "self-test"}, network);
  EXPECT_EQ(printed.code, runtime::kExitFailed);
  EXPECT_EQ(printed.text, "failed: self-test failed: a layer\n");
}

TEST(Command, SaysWhenNobodyAnswers) {
  const Printed printed = run({.what = "self-test", .timeout_s = 0.3}, dds::test_network());
  EXPECT_EQ(printed.code, runtime::kExitMissing);
  EXPECT_THAT(printed.text, HasSubstr("no answer from phantom_sensing in domain"));
}

TEST(Command, RefusesArgumentsThatContradictEachOtherBeforeItJoins) {
  const core::NetworkOptions network = dds::test_network();
  for (const CommandRequest& request :
       {CommandRequest{.what = "allow"}, CommandRequest{.what = "allow", .object = "vice", .id = 2},
        CommandRequest{.what = "forbid"}, CommandRequest{.what = "forbid", .object = "vice", .all = true},
        CommandRequest{.what = "forbid", .link = "hand", .all = true},
        CommandRequest{.what = "allow", .object = std::string(65, 'x')}}) {
    EXPECT_THROW(run(request, network), core::ConfigError) << request.what << ' ' << request.object;
  }
}

}  // namespace
}  // namespace phantom::phantom_sensing
