#pragma once
// A headset in software, in a real browser.

#include <Eigen/Geometry>
#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer::test {

using Json = nlohmann::json;

constexpr int kWidth_px = 400,
              kHeight_px = 250;  // of the window and of the headset's picture: software draws it

/// The scene in an emulated headset (npm's iwer), in a real Chromium.
class SceneInHeadset : public SceneInChromium {
 protected:
  /// Puts the headset on, and enters by the page's button.
  void enter(bool with_cell = false) {
    put_on(with_cell);
    enter_again();
  }
  /// Opens the page in a browser with a headset. Where the test does not look at the cell, it is left out of
  /// the picture, which software takes a second to draw.
  void put_on(bool with_cell = false) {
    open();
    ASSERT_TRUE(drawn());
    // Left out on purpose: it is not looked for in the picture.
    if (!with_cell) browser_->run("phantomScene.whole = true; phantomScene.stage.scene.visible = false");
    browser_->show_on(kWidth_px, kHeight_px, false);
    EXPECT_TRUE(truth("!document.getElementById('headset')")) << "no headset, no button";
    std::ifstream file(PHANTOM_IWER);
    ASSERT_TRUE(file) << PHANTOM_IWER;
    browser_->run(
        std::string(std::istreambuf_iterator<char>(file), {}) +
        ";window.headset = new IWER.XRDevice(IWER.metaQuest3, { stereoEnabled: true });"
        "headset.installRuntime({ forceInstall: true });"
        "headset.controllers.left.position.set(-0.2, 1.6, 2); headset.controllers.right.position.set(0.2, 1.6, 2);"
        "phantomScene.offerHeadset()");
    ASSERT_TRUE(eventually([&] { return truth("document.getElementById('headset')"); }));
    EXPECT_EQ(text("headset"), "Enter headset");
  }
  void enter_again() {
    browser_->run("document.getElementById('headset').click()");
    ASSERT_TRUE(eventually([&] { return truth("phantomScene.headset?.frames > 0"); }));
    browser_->run(
        "const h = phantomScene.headset, draw = h.draw.bind(h), pulse = h.feel.bind(h);"
        "window.felt = []; window.shot = ''; window.wanted = false;"
        "h.draw = frame => { for (const { gamepad, handedness } of h.session.inputSources)"
        "  gamepad.hapticActuators[0].pulse = (strength, ms) => felt.push([handedness, strength, ms]);"
        "  draw(frame); if (wanted) { wanted = false; shot = h.stage.canvas.toDataURL(); } };");
    frames(1);
  }
  Json of(const std::string& what) { return browser_->run("const h = phantomScene.headset; return " + what); }
  /// Waits until so many more frames were drawn as a whole.
  void frames(int count) {
    const int until = of("h.frames").get<int>() + count + 1;  // one is being drawn, maybe
    ASSERT_TRUE(eventually([&] { return of("h.frames").get<int>() >= until; }));
  }
  /// What both eyes see, side by side.
  cv::Mat picture(const std::string& name) {
    browser_->run("window.shot = ''; window.wanted = true");
    EXPECT_TRUE(eventually([&] { return truth("shot"); }));
    return unpacked(browser_->run("return shot"), name);
  }
  static cv::Mat unpacked(const std::string& data_url, const std::string& name) {
    const std::string bytes = from_base64(data_url.substr(data_url.find(',') + 1));
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::string(folder) + "/" + name + ".png", std::ios::binary) << bytes;
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                        cv::IMREAD_GRAYSCALE);
  }
  /// By how many pixels what the left eye sees lies farther right than what the right eye sees.
  static int disparity_px(const cv::Mat& both) {
    const int width = both.cols / 2, most = width / 8;
    int best = 0;
    double least = INFINITY;
    for (int shift = -most; shift <= most; ++shift) {
      double sum = 0;
      for (int y = 0; y < both.rows; ++y)
        for (int x = most; x < width - most; ++x)
          sum += std::abs(both.at<std::uint8_t>(y, x + shift) - both.at<std::uint8_t>(y, width + x));
      if (sum < least) least = sum, best = shift;
    }
    return best;
  }
  /// The same of the workspace's corners, least and greatest, by the eyes' cameras.
  std::pair<double, double> expected_px() {
    const Json eyes = of(
        "h.stage.renderer.xr.getCamera().cameras.map(c => [...c.projectionMatrix.clone().multiply(c.matrixWorldInverse).elements])");
    EXPECT_EQ(eyes.size(), 2U);
    std::pair<double, double> range{INFINITY, -INFINITY};
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector4d p = corner_of(cell_.min_m, cell_.max_m, corner).homogeneous();
      double x_px[2] = {};
      for (std::size_t eye = 0; eye < 2; ++eye) {
        const auto elements = eyes.at(eye).get<std::vector<double>>();
        const Eigen::Vector4d clip = Eigen::Map<const Eigen::Matrix4d>(elements.data()) * p;
        x_px[eye] = clip.x() / clip.w() * kWidth_px / 4;
      }
      range.first = std::min(range.first, x_px[0] - x_px[1]);
      range.second = std::max(range.second, x_px[0] - x_px[1]);
    }
    return range;
  }
  double eyes_apart_in_W_m() {
    const Json eyes = of(
        "h.stage.renderer.xr.getCamera().cameras.map(c => [12, 13, 14].map(i => c.matrixWorld.elements[i]))");
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i)
      square += std::pow(eyes[0][i].get<double>() - eyes[1][i].get<double>(), 2);
    return std::sqrt(square);
  }
  /// The percept that the scene stream gets from now on.
  void percept(double closeness, bool valid = true, core::Nanoseconds age_ns = 0) {
    PerceptSample sample = state_.percept;
    sample.closeness = closeness;
    sample.valid = valid;
    sample.received_ns = core::monotonic_ns() - age_ns;
    inbox_.percept.write(sample);
  }
  /// What limits the hand from now on, as the page hears it; empty: nothing.
  void limited_by(const std::string& key) {
    browser_->run(
        "const page = phantomScene.page; window.heard = window.heard || page.state;"
        "page.state = () => ({ ...heard(), limits_words: " +
        (key.empty() ? "[]" : "[{ key: '" + key + "', values: {} }]") + " })");
  }
  /// What the controllers were made to feel in some frames, for as long as four pulses take: hand, strength,
  /// ms.
  Json felt() {
    browser_->run("felt.length = 0; window.felt_since = performance.now()");
    frames(3);
    EXPECT_TRUE(eventually([&] { return truth("performance.now() - felt_since > 240"); }));
    return browser_->run("return felt");
  }
};

}  // namespace phantom::synthetic_viewer::test
