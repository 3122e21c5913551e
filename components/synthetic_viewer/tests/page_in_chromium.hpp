#pragma once
// The operator's page in a real Chromium, with a viewer that is fed by hand.

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"

namespace phantom::synthetic_viewer::test {

/// The page in a real browser, of a system that runs.
class PageInChromium : public Loop {
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
    begin_server();
    feeder_ = std::thread([this] { feed(); });
    browser_arguments_.push_back("--disable-3d-apis");  // the viewer's pictures are shown
    browser_ = std::make_unique<Browser>(browser_arguments_);
    browser_->open(server_->url());
  }
  void begin_server() {
    feed_ = std::make_unique<SceneFeed>(config_, config_.page.scene_Hz, cell_.name, inbox_, content_);
    feed_->start();
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
        },
        WebServer::OnWorkspaceRequest(), feed_.get());
  }
  void TearDown() override {
    browser_.reset();
    stop_ = true;
    if (feeder_.joinable()) feeder_.join();
    server_.reset();
    feed_.reset();
  }
  /// A system that runs.
  void feed() {
    ComponentSample component;
    component.component = "slave_io";
    component.state = core::ComponentState::kRunning;
    component.loops.push_back({"servo", 0.001, 999.7, 55, 90, 400, 12, 40, 1000, 2});
    inbox_.put(WorkspaceSample{3, workspace::VoxelSize(0.005).half_diagonal_m()});
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
      if (gripper_) {
        GripperSample gripper;
        gripper.received_ns = core::monotonic_ns();
        gripper.sense = {true, 0.0418, 0.0, 29.6, true, false};
        gripper.widest_m = 0.1;
        gripper.requested_force_N = 30.0;
        gripper.holds = true;
        inbox_.gripper.write(gripper);
      }
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

  bool gripper_ = false;  ///< set before serve(): the arm has one
  std::unique_ptr<SceneFeed> feed_;
  std::unique_ptr<WebServer> server_;
  std::vector<std::string> browser_arguments_;
  std::unique_ptr<Browser> browser_;
  std::atomic<bool> stop_{false};
  std::thread feeder_;
  std::mutex mutex_;
  std::vector<Command> commands_;
  std::vector<ViewRequest> requests_;
};

}  // namespace phantom::synthetic_viewer::test
