// The stop on the operator's page, in a real Chromium with several windows: pressed there, heard on the
// topic, and confirmed on it by stand-ins of master_io and slave_io.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <optional>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/tests/stand_in_side.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"
#include "components/synthetic_viewer/topics/dds_adapter.hpp"

namespace phantom::synthetic_viewer {
namespace {

using dds::test_network;
using test::Browser;
using test::eventually;

/// master_io and slave_io as the viewer knows them.
class StandInCell {
 public:
  StandInCell(std::size_t joint_count, const std::vector<double>& home)
      : joint_count_(static_cast<std::uint32_t>(joint_count)), home_(home), thread_([this] { run(); }) {}
  ~StandInCell() {
    ending_ = true;
    thread_.join();
  }
  bool matched() const { return master.matched() && slave.matched(); }

 private:
  dds::Participant master_host_{"master_io", test_network()}, slave_host_{"slave_io", test_network()};

 public:
  messages::StandInSide master{master_host_, teleop::Side::kMaster}, slave{slave_host_, teleop::Side::kSlave};

 private:
  void run() {
    dds::Writer<msg::MasterState> masters(master_host_, dds::kMasterState);
    dds::Writer<msg::SlaveState> slaves(slave_host_, dds::kSlaveState);
    dds::Stamper master_stamps(master_host_), slave_stamps(slave_host_);
    while (!ending_) {
      msg::MasterState state;
      state.joint_count(joint_count_);
      state.stamp(master_stamps.next());
      fill(state, master);
      masters.write(state);
      msg::SlaveState arm;
      arm.joint_count(joint_count_);
      std::copy(home_.begin(), home_.end(), arm.position_rad().begin());
      arm.contact_force_N(-1);
      arm.stamp(slave_stamps.next());
      fill(arm, slave);
      slaves.write(arm);
      usleep(5000);
    }
  }
  static void fill(auto& state, const messages::StandInSide& side) {
    state.stop(side.stop);
    state.state(side.stop != 0 ? msg::LinkState::LINK_STOPPED : msg::LinkState::LINK_COUPLED);
    state.stop_cause(side.stop != 0 ? msg::StopCause::STOP_EMERGENCY : msg::StopCause::STOP_NONE);
  }

  std::uint32_t joint_count_;
  std::vector<double> home_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

class StopInChromium : public test::Loop {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    config_.main_view.format = {640, 360, 1, true};
    config_.hit_view.rule.hold_after_clear_s = 600;
    config_.page.port = 0;
    start();
    const robot::SerialArm arm = runtime::load_arm(cell_.arm());
    const messages::ArmBounds shape{.joint_count = arm.joint_count(), .link_count = arm.links().size()};
    adapter_ = std::make_unique<DdsAdapter>(test_network(), shape, inbox_);
    content_.stops = [this] { return inbox_.stops.at(core::monotonic_ns()); };
    server_ = std::make_unique<WebServer>(
        config_.page, content_, [this](const Command& command) { return adapter_->ask(command); },
        [this](const ViewRequest& request) {
          inbox_.put(request);
          return core::Status::ok();
        });
    const auto& home = cell_.arm().home;
    sides_.emplace(arm.joint_count(), std::vector<double>(home.begin(), home.end()));
    ASSERT_TRUE(eventually([&] { return sides_->matched(); }));
    inbox_.put(alert(1, {0.71, 0.13, 1.03}));  // so that every window follows three pictures
    browser_ = std::make_unique<Browser>();
    browser_->open(server_->url());
    windows_.push_back(browser_->window());
  }
  void TearDown() override {
    browser_.reset();
    server_.reset();
    sides_.reset();
    adapter_.reset();
  }
  std::string text(const std::string& id) {
    return browser_->run("return document.getElementById('" + id + "').innerText").get<std::string>();
  }
  bool truth(const std::string& expression) {
    return browser_->run("return !!(" + expression + ")").get<bool>();
  }
  bool shown(const std::string& id) { return truth("document.getElementById('" + id + "').offsetParent"); }
  void in_every_window(const std::function<void(const std::string&)>& check) {
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      browser_->switch_to(windows_[i]);
      check("window " + std::to_string(i + 1));
    }
  }
  void keep_screenshot(const std::string& name) {
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::string(folder) + "/" + name + ".png", std::ios::binary) << browser_->screenshot();
  }
  bool confirmed() {
    return shown("stop-board") && text("stop-headline") == "EMERGENCY STOP" &&
           text("stop-master-text") == "stopped (emergency stop)" &&
           text("stop-slave-text") == "stopped (emergency stop)";
  }

  std::unique_ptr<DdsAdapter> adapter_;
  std::unique_ptr<WebServer> server_;
  std::optional<StandInCell> sides_;
  std::unique_ptr<Browser> browser_;
  std::vector<std::string> windows_;
};

// Four windows follow sixteen streams; the browser opens six. The stop is pressed where none is left.
// Tries synthetic_viewer: a browser with many windows
TEST_F(StopInChromium, PressedInTheSecondOfFourWindowsIsHeardAndConfirmedInAll) {
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  for (int more = 0; more < 3; ++more) windows_.push_back(browser_->open_window(server_->url()));
  in_every_window([&](const std::string& which) {
    EXPECT_EQ(browser_->run("return document.visibilityState"), "visible") << which;
    EXPECT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }))
        << which << ": its state comes, if not by the stream";
    EXPECT_FALSE(shown("stop-board")) << which;
  });
  browser_->switch_to(windows_[1]);
  EXPECT_EQ(sides_->slave.heard_of(teleop::CommandKind::kEmergencyStop), 0U);
  browser_->click("#stop");
  EXPECT_TRUE(eventually([&] { return sides_->slave.heard_of(teleop::CommandKind::kEmergencyStop) > 0; }));
  EXPECT_TRUE(eventually([&] { return sides_->master.stop != 0 && sides_->slave.stop != 0; }));
  in_every_window(
      [&](const std::string& which) { EXPECT_TRUE(eventually([&] { return confirmed(); })) << which; });
  browser_->switch_to(windows_[1]);
  EXPECT_EQ(text("answer"), "Emergency stop: stopped: master_io, slave_io");
  keep_screenshot("stopped");
  // Likewise in the last one, by key, after a reset from there.
  browser_->switch_to(windows_[3]);
  browser_->click("#stop-reset");  // beside the stop: the question is in the settings
  browser_->click("#reset-yes");
  EXPECT_TRUE(eventually([&] { return sides_->master.stop == 0 && sides_->slave.stop == 0; }));
  EXPECT_TRUE(eventually([&] { return !shown("stop-board"); }));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return confirmed(); }));
  EXPECT_NE(sides_->slave.stop, 0U);
}

// Tries synthetic_viewer: a stop that nobody confirms
TEST_F(StopInChromium, ASideThatDoesNotConfirmIsShoutedInEveryWindowUntilItDoes) {
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  windows_.push_back(browser_->open_window(server_->url()));
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  keep_screenshot("normal");
  sides_->slave.answers = false;
  browser_->click("#stop");
  const auto shouted = [&] {
    return shown("stop-board") && text("stop-headline") == "STOP NOT CONFIRMED" &&
           text("stop-master-text") == "stopped (emergency stop)" &&
           text("stop-slave-text") == "HAS NOT CONFIRMED THE STOP" &&
           truth("document.getElementById('stop-board').classList.contains('alarm')") &&
           truth("document.title.includes('STOP NOT CONFIRMED')");
  };
  in_every_window([&](const std::string& which) { EXPECT_TRUE(eventually(shouted)) << which; });
  EXPECT_TRUE(eventually(
      [&] { return text("answer") == "Emergency stop: NOT CONFIRMED by slave_io; stopped: master_io"; }));
  keep_screenshot("unconfirmed");
  sides_->slave.answers = true;
  in_every_window([&](const std::string& which) {
    EXPECT_TRUE(eventually([&] { return confirmed(); })) << which;
    EXPECT_FALSE(truth("document.title.includes('STOP NOT CONFIRMED')")) << which;
  });
}

}  // namespace
}  // namespace phantom::synthetic_viewer
