// A camera's pose found by picks on the page, in a real Chromium: the simulated camera really stands
// elsewhere than it was calibrated to, and what is clicked is where it sees the corners.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "components/synthetic_viewer/scene/tests/picks_of_a_page.hpp"
#include "components/synthetic_viewer/tests/camera_rig.hpp"
#include "components/synthetic_viewer/tests/page_in_chromium.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;
using ::testing::HasSubstr;

class CalibrationInChromium : public test::PageInChromium {
 protected:
  CalibrationInChromium() {
    std::filesystem::create_directories(folder_);
    VideoCamera camera = test::bent_camera();
    camera.rate_hz = 4;
    camera.calibration_file = folder_ / "gate_calibration.yaml";
    camera.names_calibration = true;
    camera.simulated.X_CS = {geometry::rotation_from_rpy(0.02, -0.01, 0.015), {0.03, -0.02, 0.03}};
    X_WS_ = *camera.calibration.X_WC * camera.simulated.X_CS;
    config_.camera_view.camera = camera;
    config_.camera_view.format = {960, 720, 1, false};
  }
  /// Opens the page, and the panel in which the pose is found.
  void open() {
    serve(true);
    for (const runtime::CellBody& body : runtime::load_bodies(cell_)) {
      const runtime::ObjectConfig& object = cell_.objects[body.body.id - 1U];
      for (MeshChunkSample& chunk : test::chunks_of(body.mesh_O, 1 << 17)) inbox_.put(std::move(chunk));
      inbox_.put(
          ObjectSample{body.body.id, object.name, body.mesh_O.content_hash(), object.X_WO, object.colour});
    }
    browser_->show_on(1280, 720, false);
    ASSERT_TRUE(eventually([&] { return truth("!document.getElementById('camera-figure').hidden"); }));
    browser_->click("#calibrate");
    ASSERT_TRUE(eventually([&] {
      return truth(
          "document.querySelectorAll('#calibration-corners li').length > 5 && "
          "document.getElementById('calibration-image').naturalWidth === 960");
    })) << text("calibration-words");
  }
  /// Chooses a corner of the list, and clicks where the real camera sees it, to the pixel of the screen.
  bool pick(const KnownCorner& corner) {
    const Eigen::Vector2d at =
        test::share_at(*config_.camera_view.camera, 960, 720, X_WS_, corner.position_W_m);
    return browser_
        ->run("const button = document.querySelector('[data-corner=\"" + corner.name +
              "\"]'); if (!button) return false; button.click();"
              "const box = document.getElementById('calibration-image').getBoundingClientRect();"
              "const x = Math.round(box.left + box.width * " +
              std::to_string(at.x()) + "), y = Math.round(box.top + box.height * " + std::to_string(at.y()) +
              "); document.elementFromPoint(x, y).dispatchEvent("
              "new MouseEvent('click', { clientX: x, clientY: y, bubbles: true })); return true;")
        .get<bool>();
  }
  void press(const char* id) { browser_->click(std::string("#calibration-") + id); }
  bool says(const char* id, const char* words) {
    return eventually([&] { return text(id).find(words) != std::string::npos; });
  }
  geometry::Pose X_WC(bool& on_trial) const { return *content_.calibration->in_force(on_trial).X_WC; }
  double off_mm() const {
    bool on_trial = false;
    return 1e3 * (X_WC(on_trial).translation_m - X_WS_.translation_m).norm();
  }
  void shoot(const char* name) {
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::string(folder) + "/" + name, std::ios::binary) << browser_->screenshot();
  }
  const std::vector<KnownCorner> corners_ = test::corners_of(cell_);
  geometry::Pose X_WS_;
};

TEST_F(CalibrationInChromium, ClickedCornersGiveThePoseThatIsTriedAndKept) {
  open();
  ASSERT_GT(off_mm(), 40.0);
  const auto& file = config_.camera_view.camera->calibration_file;
  EXPECT_TRUE(truth("document.getElementById('calibration-keep').disabled"));
  int picked = 0;
  for (const KnownCorner& corner : corners_) {
    if (!pick(corner)) continue;
    if (++picked != 2) continue;
    press("try");
    EXPECT_TRUE(says("calibration-words", "Not done: a pose needs three points, there are 2"));
  }
  ASSERT_GE(picked, 6);
  shoot("calibration_picks.png");
  press("try");
  ASSERT_TRUE(says("calibration-result", "On trial: residual")) << text("calibration-words");
  EXPECT_THAT(text("calibration-result"), HasSubstr("the worst one"));
  // Clicks are to half a pixel of the screen, about one of the camera's.
  EXPECT_LT(off_mm(), 15.0);
  EXPECT_TRUE(
      truth("document.getElementById('calibration-overlay').getAttribute('aria-pressed') === 'true'"));
  EXPECT_TRUE(eventually([&] {
    return truth(
        "document.getElementById('calibration-image').src.includes('overlay') && "
        "document.getElementById('calibration-image').naturalWidth === 960");
  }));
  ASSERT_TRUE(says("camera-caption", "gate"));
  const auto shown = content_.view(View::kCamera).jpeg.newest();
  EXPECT_TRUE(eventually([&] { return content_.view(View::kCamera).jpeg.newest() != shown; }));
  browser_->run("window.shown = document.getElementById('calibration-image').src");
  EXPECT_TRUE(eventually([&] {
    return truth(
        "document.getElementById('calibration-image').src !== window.shown && "
        "document.getElementById('calibration-image').complete");
  })) << "the overlay is live";
  EXPECT_TRUE(
      truth("document.getElementById('stop').getBoundingClientRect().top >= 0 && "
            "document.getElementById('calibration-close').getBoundingClientRect().bottom <= innerHeight"))
      << "stop and all buttons stay in sight";
  shoot("calibration_trial.png");
  EXPECT_FALSE(std::filesystem::exists(file));
  press("discard");
  EXPECT_TRUE(says("calibration-words", "the pose is as it was before"));
  EXPECT_GT(off_mm(), 40.0);
  press("try");
  ASSERT_TRUE(says("calibration-result", "On trial: residual"));
  press("keep");
  ASSERT_TRUE(says("calibration-words", "written: ")) << text("calibration-words");
  const Calibration written = load_calibration(file);
  EXPECT_LT(1e3 * (written.X_WC->translation_m - X_WS_.translation_m).norm(), 15.0);
  EXPECT_EQ(*written.lens, *config_.camera_view.camera->calibration.lens);
  press("close");
  EXPECT_TRUE(truth("document.getElementById('calibration').hidden"));
}

TEST_F(CalibrationInChromium, KeysAloneReachAllOfItInBothLanguagesAndEscStops) {
  open();
  EXPECT_TRUE(truth("document.activeElement.id === 'calibration-picture'"));
  browser_->run("document.querySelector('#languages [lang=de]').click()");
  EXPECT_TRUE(says("calibration-try", "Ort finden"));
  browser_->run("document.getElementById('calibration-picture').focus()");
  browser_->type({Browser::kLeft, Browser::kLeft, Browser::kDown, Browser::kEnter});
  EXPECT_TRUE(says("calibration-words", "1 gewählt"));
  EXPECT_NEAR(
      browser_->run("return parseFloat(document.querySelector('#calibration-marks .pick').style.left)")
          .get<double>(),
      50.0 - 2 * 100.0 / 960, 1e-3)
      << "two pixels to the left";
  // From the picture by Tab alone to a corner of the list, which is taken back, and on to the last button.
  std::string reached;
  for (int k = 0; k < 60 && reached.find("calibration-close") == std::string::npos; ++k) {
    browser_->type({Browser::kTab});
    reached += browser_
                   ->run(
                       "return (document.activeElement.id || document.activeElement.className || "
                       "document.activeElement.dataset.corner) + ' '")
                   .get<std::string>();
  }
  for (const char* one : {"undo", "level_plate:", "calibration-try", "calibration-overlay",
                          "calibration-restart", "calibration-close"})
    EXPECT_THAT(reached, HasSubstr(one));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0.0); }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
