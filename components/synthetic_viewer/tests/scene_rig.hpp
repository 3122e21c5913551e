#pragma once
// The shipped hot cell in a state that stands still, served as the viewer serves it, and a browser that draws
// it; beside them the viewer's own drawing of the same state.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/scene/drawing.hpp"
#include "components/synthetic_viewer/scene/still_scene.hpp"
#include "components/synthetic_viewer/stream/fluid_store.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer::test {

using phantom::test::eventually;

/// Returns the picture that a canvas gave as a data URL.
inline cv::Mat unpacked(const std::string& data_url) {
  const std::string bytes = from_base64(data_url.substr(data_url.find(',') + 1));
  return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                      cv::IMREAD_COLOR);
}

/// Writes a picture into the folder PHANTOM_SCREENSHOTS, if that is set, for people to look at.
inline void keep(const std::string& name, const cv::Mat& picture) {
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    cv::imwrite(std::string(folder) + "/" + name + ".png", picture);
}

class SceneInChromium : public ::testing::Test {
 protected:
  static constexpr PictureFormat kSize{1280, 720, 1, true};

  SceneInChromium() {
    config_.graphics = GraphicsPlatform::kSurfaceless;
    config_.main_view = {kSize, -0.87, 0.45, 0.59, 0.8};
    config_.hit_view.format = config_.tool_view.format = kSize;
    config_.hit_view.field_of_view_rad = 0.73;
    config_.tool_view.field_of_view_rad = 1.05;
    config_.tool_view.eye_m = {0.16, 0, 0.06};
    config_.tool_view.look_at_m = {0, 0, -0.12};
    config_.staleness.slave_s = config_.staleness.percept_s =
        3600;  // the state stands still, however slow the machine
    config_.page.port = 0;
  }
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    take_still_scene();
  }
  void TearDown() override {
    browser_.reset();
    stop_ = true;
    if (feeder_.joinable()) feeder_.join();
    server_.reset();
    feed_.reset();
  }

  /// Serves the state, and opens the page in a browser with these further arguments, which draws by its
  /// operator's choice however slowly.
  void open(std::vector<std::string> arguments = {"--use-angle=swiftshader", "--enable-unsafe-swiftshader"}) {
    open_without_choice(std::move(arguments));
    ASSERT_TRUE(eventually([&] { return truth("document.getElementById('server-pictures')"); }));
    browser_->run("for (let i = 0; i < 2; ++i) document.getElementById('server-pictures').click()");
  }
  void open_without_choice(std::vector<std::string> arguments = {"--use-angle=swiftshader",
                                                                 "--enable-unsafe-swiftshader"}) {
    feed_ = std::make_unique<SceneFeed>(config_, config_.page.scene_Hz, cell_.name, inbox_, content_, hand_);
    feed_->start();
    serve();
    arguments.push_back("--js-flags=--expose-gc");
    arguments.push_back("--enable-precise-memory-info");
    browser_ = std::make_unique<Browser>(arguments);
    browser_->open(server_->url());
  }
  void serve() {
    server_ = std::make_unique<WebServer>(
        config_.page, content_,
        [this](const Command& command) {
          const std::lock_guard lock(mutex_);
          commands_.push_back(command.kind);
          return CommandOutcome{CommandOutcome::Kind::kDone, "sent"};
        },
        [this](const ViewRequest& request) {
          const std::lock_guard lock(mutex_);
          requests_.push_back(request);
          return core::Status::ok();
        },
        WebServer::OnWorkspaceRequest(), feed_.get());
    feeder_ = std::thread([this] { keep_up(); });
  }
  bool truth(const std::string& expression) {
    return browser_->run("return !!(" + expression + ")").get<bool>();
  }
  std::string text(const std::string& id) {
    return browser_->run("return document.getElementById('" + id + "').textContent").get<std::string>();
  }
  /// Waits until the browser draws the whole cell.
  bool drawn() {
    constexpr double kMax_s = 180;  // software draws, of a machine that may be busy
    const std::size_t meshes = drawing_->scene().meshes.size();
    const auto whole = [&] {
      return truth(
          "window.phantomScene && phantomScene.shown && phantomScene.stage.items.size > " +
          std::to_string(meshes) +
          " && [...phantomScene.stage.items.values()].every(i => phantomScene.stage.meshes.has(i.mesh))"
          " && phantomScene.firstPicture_ms > 0");
    };
    return eventually(whole, kMax_s);
  }
  void turn_arm(double angle_rad) { turned_rad_ = angle_rad; }

  const runtime::CellConfig cell_ = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  HeadsetHand* hand_ = nullptr;  ///< none: no controller may lead
  ViewerConfig config_;
  PageContent content_;
  Inbox inbox_;
  ViewerState state_;
  std::shared_ptr<const workspace::Workspace> workspace_;
  FluidStore fluid_{[this] {
    const std::lock_guard lock(mutex_);
    return workspace_;
  }};
  std::unique_ptr<Drawing> drawing_;
  std::unique_ptr<SceneFeed> feed_;
  std::unique_ptr<WebServer> server_;
  std::unique_ptr<Browser> browser_;
  std::mutex mutex_;
  std::vector<ViewRequest> requests_;
  std::vector<teleop::CommandKind> commands_;  ///< that the page sent

 private:
  /// The arm over the pump, with percept, paint and an alert, as the topics would give it.
  void take_still_scene() {
    StillPose pose;
    pose.velocity = std::vector<double>(cell_.arm().home.size(), 0.05);
    ViewerState still;
    HitSample hit;
    std::thread([&] {  // a thread has one renderer
      Renderer renderer(GraphicsPlatform::kSurfaceless);
      const StillScene scene = make_still_scene(cell_, pose, renderer);
      still = scene.state;
      hit = scene.hit();
      workspace_ = scene.workspace;
    })
        .join();
    content_.fluid = &fluid_;
    const robot::SerialArm arm = runtime::load_arm(cell_.arm());
    drawing_ = std::make_unique<Drawing>(config_, cell_, arm,
                                         load_arm_meshes(arm, runtime::load_skin(cell_.arm(), arm)), state_,
                                         Drawing::kMaxTriangles, &content_.meshes);
    now_ns_ = core::monotonic_ns();
    for (const runtime::CellBody& body : runtime::load_bodies(cell_)) {
      const runtime::ObjectConfig& object = cell_.objects[body.body.id - 1U];
      for (MeshChunkSample& chunk : chunks_of(body.mesh_O, 1 << 20))
        ASSERT_TRUE(drawing_->take(std::move(chunk)));
      state_.take(
          ObjectSample{body.body.id, object.name, body.mesh_O.content_hash(), object.X_WO, object.colour},
          now_ns_);
    }
    state_.workspace = still.workspace;
    state_.arm = still.arm;
    state_.percept = still.percept;
    // Closer than it is at home, so that all aids are there.
    state_.percept.valid = true;
    state_.percept.closeness = 0.6;
    SkinSample skin = still.skin;
    skin.valid = true;
    if (skin.patch_m <= 0) skin.patch_m = 0.02;
    for (std::size_t link = 3; link < 7; ++link)
      skin.felt.push_back({link, {0.02F, 0.03F, 0.05F}, 0.3F + 0.1F * static_cast<float>(link)});
    state_.arm.received_ns = state_.percept.received_ns = skin.received_ns = now_ns_;
    drawing_->paint(skin);
    state_.skin = skin;
    hit.received_ns = now_ns_;
    hit.look_at_m = {0.40, -0.22, 0.55};
    hit.pgv = {0, 0, -0.02};
    hit.arm = state_.arm;
    hit.percept = state_.percept;
    state_.take(hit);
    drawing_->take(hit);
    for (int round = 0; round < 5; ++round) drawing_->advance(now_ns_ += core::from_seconds(0.1), 0.1);
    content_.scene.publish(drawing_->scene_base());
  }
  /// The page's numbers, and the arm's samples where it turns.
  void keep_up() {
    constexpr double kFramesPerS = 10.0;
    const PageFacts facts{cell_.name, true, true, kFramesPerS, "test", now_ns_, ""};
    int rounds = 0;
    while (!stop_) {
      const core::Nanoseconds now_ns = core::monotonic_ns();
      if (rounds++ % 10 == 0)
        content_.state.publish(
            page_state(state_, drawing_->scene(), drawing_->hit_view(), config_.staleness, facts, now_ns));
      if (const double turned_rad = turned_rad_; turned_rad != 0.0) {
        ArmSample arm = state_.arm;
        arm.received_ns = now_ns;
        arm.position[1] += turned_rad * std::sin(core::seconds(now_ns));
        inbox_.arm.write(arm);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  core::Nanoseconds now_ns_ = 0;
  std::atomic<bool> stop_{false};
  std::atomic<double> turned_rad_{0.0};
  std::thread feeder_;
};

}  // namespace phantom::synthetic_viewer::test
