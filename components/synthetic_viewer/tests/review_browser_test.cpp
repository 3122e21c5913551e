// A recorded session in a real Chromium: by keyboard to an alert, the time line, the plots, and nothing that
// commands.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "components/synthetic_viewer/review/tests/recorded_session.hpp"
#include "components/synthetic_viewer/review_command.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;

constexpr double kEntered_s = 0.02;  // the page goes so far behind an alert's mark

class ReviewInChromium : public test::TwoPlates {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    std::filesystem::create_directories(folder_);
    robot::SerialArm arm = runtime::load_arm(cell_.arm());
    {
      test::RecordingWriter writer(folder_ / "session.mcap");
      test::write_session(writer, cell_.arm().home, arm.links().size(), 20, 50, 1);
      writer.finish();
    }
    review_ = std::make_unique<Review>(recording::open_recordings({folder_ / "session.mcap"}), arm);
    config_.page.port = 0;
    auto meshes = load_arm_meshes(arm, runtime::load_skin(cell_.arm(), arm));
    session_ = std::make_unique<ReviewedSession>(*review_, config_, cell_, std::move(arm), std::move(meshes));
    browser_ = std::make_unique<Browser>(arguments());
    browser_->open(session_->url());
    ASSERT_TRUE(eventually([this] { return truth("document.getElementById('review-bar')"); }));
  }
  void TearDown() override { browser_.reset(); }
  /// Of Chromium: it shows the viewer's pictures.
  virtual std::vector<std::string> arguments() const { return {"--disable-3d-apis"}; }

  bool truth(const std::string& expression) {
    return browser_->run("return !!(" + expression + ")").get<bool>();
  }
  std::string text(const std::string& id) {
    return browser_->run("return document.getElementById('" + id + "').textContent").get<std::string>();
  }
  double t() const {
    return core::seconds(review_->position(core::monotonic_ns()).at_ns - review_->begin_ns());
  }
  double mark_t(std::size_t number) const {
    return core::seconds(review_->marks().at(number).raised_ns - review_->begin_ns());
  }
  /// Where the line that tells the moment stands: its share of the time that a canvas shows.
  double cursor_share(const std::string& id) {
    return browser_
        ->run("const c = document.getElementById('" + id + "'), line = document.getElementById('" + id +
              "-cursor'); return line.offsetParent === null ? -1 : (line.getBoundingClientRect().left + 1 - "
              "c.getBoundingClientRect().left - 46) / (c.clientWidth - 54)")
        .get<double>();
  }
  void keep_screenshot(const char* name) {
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::filesystem::path(folder) / name, std::ios::binary) << browser_->screenshot();
  }

  std::unique_ptr<Review> review_;
  std::unique_ptr<ReviewedSession> session_;
  std::unique_ptr<Browser> browser_;
};

TEST_F(ReviewInChromium, ReachesAlertsByKeyboardAndShowsThem) {
  ASSERT_GT(review_->marks().size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) {
    browser_->type({"]"});
    ASSERT_TRUE(eventually([&] { return std::abs(t() - mark_t(i) - kEntered_s) < 1e-4; }))
        << t() << " " << mark_t(i);
    ASSERT_TRUE(eventually([&] {
      return text("review-alert").find("Alert " + std::to_string(i + 1) + " of ") == 0 &&
             text("hit-count") == std::to_string(i + 1);
    }));
  }
  browser_->type({"["});
  ASSERT_TRUE(eventually([&] { return std::abs(t() - mark_t(1) - kEntered_s) < 1e-4; }));
  // The zone is shown, and its picture comes.
  ASSERT_TRUE(eventually([&] {
    return text("hit-caption").find("Alert ") == 0 &&
           truth("document.getElementById('hit-view').naturalWidth > 0");
  }));
  // Time line and plots stand there, too, and the first pictures of the alerts come when nothing else is
  // drawn.
  const double share = (mark_t(1) + kEntered_s) / review_->duration_s();
  for (const char* id : {"review-line", "review-plots"})
    EXPECT_TRUE(eventually([&] { return std::abs(cursor_share(id) - share) < 0.005; })) << id;
  browser_->type({"j"});
  EXPECT_TRUE(eventually([&] {
    return truth(
        "document.querySelectorAll('#hits img').length == 2 && "
        "[...document.querySelectorAll('#hits img')].every(i => i.naturalWidth > 0 && !i.hidden)");
  }));
  keep_screenshot("review_alert.png");
}

/// In a browser that draws the scene by itself.
class ReviewDrawnInChromium : public ReviewInChromium {
 protected:
  ReviewDrawnInChromium() {
    config_.frame_rate_hz = 10;
  }  // as shipped: the page's numbers cost a browser more than the scene
  std::vector<std::string> arguments() const override {
    return {"--use-angle=swiftshader", "--enable-unsafe-swiftshader"};
  }
  /// Goes to a moment as the page does. Returns the time until a picture was drawn of other poses than
  /// before, in ms, and these poses.
  std::pair<double, nlohmann::json> go(double t_s) {
    browser_->run(
        "window.answer = null; const d = phantomScene, before = JSON.stringify(d.stage.poses.bodies), begun = performance.now();"
        "d.drawViews = function () { Object.getPrototypeOf(d).drawViews.call(d); const now = JSON.stringify(d.stage.poses.bodies);"
        "  if (now !== before) window.answer = window.answer || [performance.now() - begun, now]; };"
        "fetch('review', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{\"t\": " +
        std::to_string(t_s) + "}' })");
    EXPECT_TRUE(eventually([&] { return truth("window.answer"); })) << t_s;
    const nlohmann::json answer = browser_->run("return window.answer");
    return {answer.at(0), answer.at(1)};
  }
};

TEST_F(ReviewDrawnInChromium, GoesToAnyMomentAndBackAndPlays) {
  if (browser_->run("return fetch('scene.js').then(answer => answer.status)") == 404)
    GTEST_SKIP() << "built without the browser's scene";
  ASSERT_TRUE(eventually([&] { return truth("document.getElementById('server-pictures')"); }));
  browser_->run(
      "for (let i = 0; i < 2; ++i) document.getElementById('server-pictures').click()");  // by choice
  ASSERT_TRUE(eventually([&] {
    return truth(
        "window.phantomScene && phantomScene.shown && phantomScene.stage.items.size > 3 && "
        "[...phantomScene.stage.items.values()].every(i => phantomScene.stage.meshes.has(i.mesh))");
  }));
  EXPECT_TRUE(eventually([&] { return text("scene-source") == "Drawn in this browser"; }));
  std::vector<double> times_ms;
  std::map<double, nlohmann::json> poses;
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 12; ++i) {
      const double t_s = 1.013 + 0.987 * ((5 * i) % 12);  // to and fro
      const auto [ms, shown] = go(t_s);
      times_ms.push_back(ms);
      EXPECT_EQ(poses.try_emplace(t_s, shown).first->second, shown) << "the same moment is the same picture";
    }
  }
  std::ranges::sort(times_ms);
  std::cout << "review: " << times_ms[times_ms.size() / 2]
            << " ms from a request to the drawn picture, 95 of 100 in "
            << times_ms[times_ms.size() * 95 / 100] << " ms\n";
  EXPECT_TRUE(eventually([&] {  // numbers and time line come there, too
    const double behind_s =
        std::stod(browser_->run("return document.getElementById('review-line').getAttribute('aria-valuenow')")
                      .get<std::string>()) -
        t();
    if (std::abs(behind_s) > 0.01) return false;
    return truth("Math.abs(phantomScene.page.state().review.t - " + std::to_string(t()) +
                 ") < 1e-3 && !phantomScene.page.state().review.playing");
  }));
  browser_->run(
      "window.seen = new Set(); const d = phantomScene, take = d.takePoses.bind(d);"
      "d.takePoses = (poses, buffer) => { seen.add(JSON.stringify(poses.bodies)); take(poses, buffer); };");
  browser_->type({" "});
  EXPECT_TRUE(eventually([&] { return truth("seen.size > 20"); })) << "it moves";
  keep_screenshot("review_scene.png");
}

TEST_F(ReviewInChromium, SaysThatNothingIsLiveAndCommandsNothing) {
  EXPECT_THAT(text("review-notice"), testing::HasSubstr("Nothing here is live"));
  EXPECT_TRUE(truth("getComputedStyle(document.getElementById('stop')).display === 'none'"));
  browser_->type({"o"});
  for (const char* id : {"gain-form", "gripper-open", "reset"})
    EXPECT_TRUE(truth("document.getElementById('" + std::string(id) + "').offsetParent === null")) << id;
  browser_->type({Browser::kEscape});  // who stops by habit is told that nothing was stopped
  ASSERT_TRUE(
      eventually([&] { return text("stop-headline").find("STOP NOT SENT: this is a recording") == 0; }));
  keep_screenshot("review_stop.png");
}

}  // namespace
}  // namespace phantom::synthetic_viewer
