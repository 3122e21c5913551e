// The operator's page in a real Chromium: live data, mouse and keyboard, and nothing where it only shows.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <mutex>

#include "components/synthetic_viewer/tests/certificate.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"
#include "components/synthetic_viewer/tls_context.hpp"
#include "components/synthetic_viewer/web_server.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;

class PageInChromium : public test::Loop {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
  }
  void serve(bool allow_commands) {
    config_.main_view.format = {640, 360, 1, true};
    config_.hit_view.rule.hold_after_clear_s = 600;
    config_.page.port = 0;
    config_.page.allow_commands = allow_commands;
    start();
    content_.stops = [this] { return inbox_.stops.at(core::monotonic_ns()); };
    server_ = std::make_unique<WebServer>(
        config_.page, content_,
        [this](const Command& command) {
          const std::lock_guard lock(mutex_);
          commands_.push_back(command);
          inbox_.put(command);  // as it comes back over the topic
          return CommandOutcome{CommandOutcome::Kind::kDone, "sent"};
        },
        [this](const ViewRequest& request) {
          const std::lock_guard lock(mutex_);
          requests_.push_back(request);
          inbox_.put(request);
          return core::Status::ok();
        });
    feeder_ = std::thread([this] { feed(); });
    browser_ = std::make_unique<Browser>(browser_arguments_);
    browser_->open(server_->url());
  }
  void TearDown() override {
    browser_.reset();
    stop_ = true;
    if (feeder_.joinable()) feeder_.join();
    server_.reset();
  }
  /// A system that runs.
  void feed() {
    ComponentSample component;
    component.component = "slave_io";
    component.state = core::ComponentState::kRunning;
    component.loops.push_back({"servo", 0.001, 999.7, 55, 90, 400, 12, 40, 1000, 2});
    inbox_.put(WorkspaceSample{3, 0.005});
    inbox_.put(alert(1, {0.71, 0.13, 1.03}));
    while (!stop_) {
      send_pose();
      PerceptSample percept({}, core::monotonic_ns());
      percept.valid = true;
      percept.closeness = 0.47;
      percept.speed_m_s = 0.12;
      percept.motion = MotionClass::kDangerous;
      percept.link = 2;
      percept.drag_torque_Nm = {0.1, 0.2, 0.3};
      inbox_.percept.write(percept);
      MasterSample master({}, core::monotonic_ns());
      master.state = LinkState::kCoupled;
      master.percept_gain = 1.5;
      master.law = teleop::BilateralLaw::kSctfb;
      master.percept_enabled = true;
      master.percept_torque_Nm = {0.5, -0.8, 0.2};
      master.round_trip_s = 0.0021;
      inbox_.master.write(master);
      component.received_ns = core::monotonic_ns();
      inbox_.put(component);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  std::string text(const std::string& id) {
    return browser_->run("return document.getElementById('" + id + "').textContent").get<std::string>();
  }
  bool truth(const std::string& expression) {
    return browser_->run("return !!(" + expression + ")").get<bool>();
  }
  bool commanded(CommandKind kind, double value) {
    const std::lock_guard lock(mutex_);
    return std::any_of(commands_.begin(), commands_.end(), [&](const Command& command) {
      return command.kind == kind && command.value == value;
    });
  }
  template <class Condition>
  bool requested(const Condition& condition) {
    const std::lock_guard lock(mutex_);
    return std::any_of(requests_.begin(), requests_.end(), condition);
  }

  std::unique_ptr<WebServer> server_;
  std::vector<std::string> browser_arguments_;
  std::unique_ptr<Browser> browser_;
  std::atomic<bool> stop_{false};
  std::thread feeder_;
  std::mutex mutex_;
  std::vector<Command> commands_;
  std::vector<ViewRequest> requests_;
};

TEST_F(PageInChromium, ShowsViewsGaugesAlertsAndComponentsLive) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_EQ(text("voxel-error"), "4.3 mm");
  EXPECT_EQ(text("round-trip"), "2.10 ms");
  EXPECT_EQ(text("closeness"), "0.47");
  EXPECT_EQ(text("motion"), "dangerous");
  EXPECT_EQ(browser_->run("return document.querySelectorAll('#joints .joint').length"), 6);
  EXPECT_EQ(browser_->run("return document.querySelectorAll('#joints .joint .value')[1].textContent"),
            "-0.80");
  EXPECT_THAT(text("components"), testing::HasSubstr("slave_io"));
  EXPECT_THAT(text("components"), testing::HasSubstr("RUNNING"));
  for (const char* view : {"main-view", "hit-view", "tool-view"}) {
    EXPECT_TRUE(eventually([&] {
      return truth(std::string("document.getElementById('") + view + "').naturalWidth > 0");
    })) << view;
  }
  EXPECT_TRUE(eventually([&] { return truth("document.querySelector('#hits img').naturalWidth > 0"); }))
      << "the alert's picture";
  EXPECT_EQ(text("banner"), "");
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS")) {
    std::ofstream(std::string(folder) + "/page.png", std::ios::binary) << browser_->screenshot();
  }
  EXPECT_EQ(
      browser_->run("document.querySelectorAll('body *').forEach(e => { e.hidden = true });"
                    "return [...document.querySelectorAll('body *')].filter(e => e.offsetParent).length"),
      0)
      << "what is hidden takes no room, whatever its style";
}

TEST_F(PageInChromium, SetsThePerceptsEachByItsButtonAndItsKey) {
  serve(true);
  ASSERT_TRUE(
      eventually([&] { return text("percepts") == "b1: SCTFB, balanced arm: drag, tone and views"; }));
  for (const auto& [id, value] :
       std::map<std::string, double>{{"drag", 6}, {"tone", 5}, {"views", 3}, {"by-law", 8}}) {
    browser_->run("document.getElementById('" + id + "').click()");
    EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kSetPercepts, value); })) << id;
  }
  {
    const std::lock_guard lock(mutex_);
    commands_.clear();
  }
  browser_->run("document.activeElement.blur()");
  for (const auto& [key, value] : std::map<std::string, double>{{"d", 6}, {"m", 5}, {"v", 3}, {"l", 8}}) {
    browser_->type({key});
    EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kSetPercepts, value); })) << key;
  }
  EXPECT_TRUE(truth("document.getElementById('counterbalance').hidden")) << "the arm is balanced";
  EXPECT_TRUE(truth("document.getElementById('drag').getAttribute('aria-pressed') === 'true'"));
}

TEST_F(PageInChromium, MouseAndWheelMoveTheCameras) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  browser_->drag("#main-view", 80, 40);
  EXPECT_TRUE(eventually([&] {
    return requested([](const ViewRequest& r) {
      return r.view == View::kMain && r.azimuth_rad < -0.1 && r.elevation_rad > 0.05;
    });
  }));
  browser_->wheel("#main-view", -100);
  EXPECT_TRUE(eventually([&] { return requested([](const ViewRequest& r) { return r.zoom < 1; }); }));
  ASSERT_TRUE(eventually([&] { return truth("!document.querySelector('[data-tools=main] .home').hidden"); }));
  browser_->run("document.querySelector('[data-tools=main] .home').click()");
  EXPECT_TRUE(eventually([&] { return truth("document.querySelector('[data-tools=main] .home').hidden"); }));
}

TEST_F(PageInChromium, EverythingCanBeDoneByKeyboard) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  // Tab reaches every control that is there to be used.
  const int controls =
      browser_
          ->run(
              "return [...document.querySelectorAll('button, input, select, summary, [data-view], #hits a')]"
              ".filter(e => e.offsetParent && !e.disabled && (e.tagName !== 'A' || e.href)).length")
          .get<int>();
  browser_->run("window.reached = new Set(); addEventListener('focusin', e => window.reached.add(e.target))");
  browser_->type(std::vector<std::string>(static_cast<std::size_t>(controls) + 3, Browser::kTab));
  EXPECT_GE(browser_->run("return window.reached.size").get<int>(), controls);
  browser_->run("document.getElementById('hit-view').focus()");
  browser_->type({Browser::kLeft, "+", "t", "h", "3"});
  EXPECT_TRUE(eventually(
      [&] { return commanded(CommandKind::kViewNode, 13) && commanded(CommandKind::kViewNode, 3); }));
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kViewHold, 1); }));
  EXPECT_TRUE(eventually([&] {
    return requested([](const ViewRequest& r) { return r.view == View::kHit && r.azimuth_rad < 0; }) &&
           requested([](const ViewRequest& r) { return r.view == View::kHit && r.zoom < 1; });
  }));
  browser_->type({"r"});
  EXPECT_TRUE(eventually([&] {
    return requested([](const ViewRequest& r) { return r.view == View::kHit && r.record == true; });
  }));
  ASSERT_TRUE(eventually(
      [&] { return truth("document.querySelector('[data-tools=hit] .record').ariaPressed === 'true'"); }));
  browser_->type({"r"});
  EXPECT_TRUE(eventually([&] { return requested([](const ViewRequest& r) { return r.record == false; }); }));
  // A letter that is typed into a number is a letter.
  browser_->run("document.getElementById('gain').focus()");
  browser_->type({"b", "2", "d"});
  EXPECT_FALSE(commanded(CommandKind::kSetPercepts, 6));
  EXPECT_FALSE(commanded(CommandKind::kViewNode, 14));
  EXPECT_FALSE(commanded(CommandKind::kViewNode, 2));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0); }));
}

TEST_F(PageInChromium, OnlyShowsWhereCommandsAreSwitchedOff) {
  serve(false);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_EQ(browser_->run(
                "return document.querySelectorAll('#commands button:not(:disabled), #commands input:not"
                "(:disabled), #commands select:not(:disabled), #stop:not(:disabled), #node:not(:disabled), "
                ".tools button:not(:disabled)').length"),
            0);
  EXPECT_THAT(text("answer"), testing::HasSubstr("switched off"));
  browser_->run("document.getElementById('main-view').focus()");
  browser_->type({Browser::kEscape, Browser::kLeft, "t", "h", "r", "d"});
  browser_->drag("#main-view", 60, 0);
  EXPECT_TRUE(eventually([&] { return text("answer").find("only shows") != std::string::npos; }));
  const std::lock_guard lock(mutex_);
  EXPECT_TRUE(commands_.empty());
  EXPECT_TRUE(requests_.empty());
}

TEST_F(PageInChromium, StopsWithoutASessionAndShowsAndCommandsWithOne) {
  config_.page.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve(true);
  const auto log_in = [&](const std::string& secret) {
    ASSERT_TRUE(eventually([&] { return truth("document.getElementById('login').offsetParent"); }));
    browser_->run("document.getElementById('secret').value = '" + secret +
                  "'; document.querySelector('#login button').click()");
  };
  log_in("wrong-wrong-wrong-wrong");
  EXPECT_TRUE(eventually([&] { return text("login-answer").find("none of the page") != std::string::npos; }));
  EXPECT_EQ(text("slave-state"), "–");
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0); }));
  log_in("watch-watch-watch");
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('main-view').naturalWidth > 0"); }));
  EXPECT_EQ(text("role"), "Role: watch");
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('reset').disabled"); }));
  EXPECT_TRUE(truth("!document.getElementById('stop').disabled"));
  browser_->run("document.getElementById('logout').click()");
  log_in("operate-operate-1");
  EXPECT_TRUE(eventually([&] { return text("role") == "Role: operate"; }));
  EXPECT_TRUE(eventually([&] {
    return truth("!document.getElementById('reset').disabled && document.getElementById('law').disabled");
  }));
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS")) {
    std::ofstream(std::string(folder) + "/operate.png", std::ios::binary) << browser_->screenshot();
  }
}

// The session's cookie goes by TLS alone, and to the streams' port, too.
TEST_F(PageInChromium, ShowsAndCommandsByHttps) {
  const test::Certificate own;
  config_.page.tls = std::make_shared<TlsContext>(own.certificate, own.key);
  config_.page.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  browser_arguments_ = {"--ignore-certificate-errors"};  // it is signed by nobody that the browser knows
  serve(true);
  EXPECT_TRUE(server_->url().starts_with("https://"));
  ASSERT_TRUE(eventually([&] { return truth("document.getElementById('login').offsetParent"); }));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0); }));
  browser_->run(
      "document.getElementById('secret').value = 'operate-operate-1'; document.querySelector('#login button').click()");
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('main-view').naturalWidth > 0"); }));
  EXPECT_TRUE(eventually([&] { return truth("source.readyState === EventSource.OPEN && lastEvent > 0"); }))
      << "events come by their own port";
  browser_->type({"t"});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kViewNode, 13); }));
}

TEST_F(PageInChromium, SaysThatTheViewerIsGone) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  server_.reset();
  EXPECT_TRUE(
      eventually([&] { return text("banner").find("NO CONNECTION TO THE VIEWER") != std::string::npos; }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
