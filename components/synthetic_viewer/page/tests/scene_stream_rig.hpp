#pragma once
// The scene stream's followers over real sockets, and what serves them.

#include <gtest/gtest.h>

#include <atomic>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "components/synthetic_viewer/page/tests/raw_client.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"

namespace phantom::synthetic_viewer::test {

class SceneStream : public Page {
 protected:
  ~SceneStream() override {
    moving_ = false;
    if (mover_.joinable()) mover_.join();
    server_.reset();
  }
  void serve_scene(PageConfig config = {}) {
    config_.page = config;
    config_.page.scene_Hz = 60;
    feed_ =
        std::make_unique<SceneFeed>(config_, config_.page.scene_Hz, "two plates", inbox_, content_, hand_);
    feed_->start();
    scene_ = feed_.get();
    serve(config_.page);
    publish_base();
  }
  void publish_base() {
    SceneBase base;
    base.scene = cell_scene_;
    content_.scene.publish(std::move(base));
  }
  /// Moves the arm at 200 Hz.
  void move() {
    moving_ = true;
    mover_ = std::thread([this] {
      for (double q = 0.0; moving_; q += 0.001) {
        ArmSample arm;
        arm.received_ns = core::monotonic_ns();
        arm.position[0] = q;
        inbox_.arm.write(arm);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  /// One who follows the numbers alone.
  RawClient& follow_numbers(const std::string& headers = "") {
    return clients_.emplace_back(server_->stream_port(), headers, trusted_);
  }
  RawClient& follow_scene(const std::string& headers = "") {
    RawClient& client = follow_numbers(headers);
    if (client.head.starts_with("HTTP/1.1 101")) client.put(web::test::client_frame(1, R"({"rate_Hz":60})"));
    return client;
  }
  std::string origin() const { return "http://127.0.0.1:" + std::to_string(server_->port()); }

  HeadsetHand* hand_ = nullptr;  ///< none: no controller may lead
  ViewerConfig config_;
  Inbox inbox_;
  const runtime::CellConfig cell_ =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml");
  std::shared_ptr<const CellScene> cell_scene_ =
      std::make_shared<const CellScene>(runtime::load_arm(cell_.arm()), cell_.min_m, cell_.max_m);
  std::unique_ptr<SceneFeed> feed_;
  std::list<RawClient> clients_;
  std::atomic<bool> moving_{false};
  std::thread mover_;
};

}  // namespace phantom::synthetic_viewer::test
