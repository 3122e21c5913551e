// The scene in a headset, which is emulated (npm's iwer) in a real Chromium: in stereo, life-size or in the
// hand; what is felt and what is read there.
#include <gmock/gmock.h>

#include "components/synthetic_viewer/tests/headset_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::eventually;
using test::Json;
using test::kHeight_px;
using test::kWidth_px;
using test::SceneInHeadset;

constexpr double kEyesApart_m = 0.063;                    // iwer's
constexpr double kCapital = 0.72;                         // height of a capital letter, of the font's size
constexpr double kReadable_rad = 22.0 / 60 * M_PI / 180;  // of a capital letter: ISO 9241-303

TEST_F(SceneInHeadset, IsSeenByTwoEyesLifeSizeAndInTheHand) {
  enter(true);
  EXPECT_EQ(text("headset"), "Leave headset");
  EXPECT_EQ(text("scene-source"), "Pictures from the server: Shown in the headset");
  EXPECT_EQ(of("h.place.scale"), 1);
  EXPECT_NEAR(eyes_apart_in_W_m(), kEyesApart_m, 1e-4) << "life-size";
  EXPECT_NEAR(of("h.stage.renderer.xr.getCamera().cameras[0].matrixWorld.elements[14]").get<double>(),
              cell_.min_m.z() + 1.6, 1e-3)
      << "who is 1.6 m tall stands on the floor";
  const cv::Mat life = picture("headset_life");
  const auto expected = expected_px();
  const int disparity = disparity_px(life);
  std::cout << "headset: life-size " << disparity << " px of " << expected.first << " to " << expected.second
            << '\n';
  EXPECT_GT(disparity, 0) << "what is near lies farther right for the left eye";
  EXPECT_GE(disparity, expected.first - 1);
  EXPECT_LE(disparity, expected.second + 1);
  double mean_difference =
      cv::norm(life.colRange(0, kWidth_px / 2), life.colRange(kWidth_px / 2, kWidth_px), cv::NORM_L1) /
      (kWidth_px / 2 * kHeight_px);
  EXPECT_GT(mean_difference, 0.5) << "each eye sees its own picture";
  EXPECT_LE(of("h.stage.renderer.info.render.calls").get<int>(), 60);

  browser_->run("headset.controllers.left.updateButtonValue('x-button', 1)");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.headset.table"); })) << "X changes the size";
  browser_->run("headset.controllers.left.updateButtonValue('x-button', 0)");
  frames(1);
  const double scale = of("h.place.scale").get<double>();
  EXPECT_NEAR(scale * (cell_.max_m - cell_.min_m).maxCoeff(), 0.6, 1e-6) << "0.6 m across";
  EXPECT_NEAR(eyes_apart_in_W_m(), kEyesApart_m / scale, 1e-3) << "to a small world eyes are far apart";
  const cv::Mat small = picture("headset_hand");
  const auto expected_small = expected_px();
  const int disparity_small = disparity_px(small);
  std::cout << "headset: in the hand " << disparity_small << " px of " << expected_small.first << " to "
            << expected_small.second << '\n';
  EXPECT_GT(disparity_small, disparity) << "it is nearer";
  EXPECT_LE(disparity_small, expected_small.second + 1);
  EXPECT_FALSE(truth("phantomScene.headset.pressed")) << "one press, one change";
}

TEST_F(SceneInHeadset, IsCarriedAndScaledByTheControllersAndEnds) {
  enter();
  const auto grip = [&](const char* hand, double x, double y, double z, int pressed) {
    browser_->run("const c = headset.controllers." + std::string(hand) + "; c.position.set(" +
                  std::to_string(x) + "," + std::to_string(y) + "," + std::to_string(z) +
                  "); c.updateButtonValue('squeeze', " + std::to_string(pressed) + ")");
    frames(1);
  };
  const double scale = of("h.place.scale").get<double>();
  const double height = of("h.place.shift_m.y").get<double>();
  grip("right", 0.2, 1.2, -0.4, 1);
  grip("right", 0.2, 1.3, -0.4, 1);
  EXPECT_NEAR(of("h.place.shift_m.y").get<double>() - height, 0.1, 1e-5);
  grip("left", -0.2, 1.3, -0.4, 1);
  grip("left", -0.6, 1.3, -0.4, 1);
  EXPECT_NEAR(of("h.place.scale").get<double>() / scale, 2, 0.05) << "where they grip is not where they are";
  grip("left", -0.6, 1.3, -0.4, 0);
  grip("right", 0.2, 1.2, -0.4, 0);

  const std::string browser_draws = "phantomScene.shown && !phantomScene.headset";
  browser_->run("document.getElementById('headset').click()");
  EXPECT_TRUE(eventually([&] { return truth(browser_draws); })) << "left by the page's button";
  EXPECT_TRUE(eventually([&] { return text("scene-source") == "Drawn in this browser"; }));
  enter_again();
  EXPECT_EQ(of("h.place.scale"), 1);
  browser_->run("headset.activeSession.end()");
  EXPECT_TRUE(eventually([&] { return truth(browser_draws); })) << "taken off";
}

TEST_F(SceneInHeadset, TheControllersVibrateByThePerceptAlone) {
  using testing::Each;
  using testing::ElementsAre;
  using testing::IsEmpty;
  const auto strength_of_all = [this](double closeness) {
    percept(closeness);
    EXPECT_TRUE(
        eventually([&] { return std::abs(of("h.stage.poses.closeness").get<double>() - closeness) < 1e-6; }));
    const Json pulses = felt();
    EXPECT_GE(pulses.size(), 4U) << "as long as it lasts, both hands";
    for (const char* hand : {"left", "right"})
      EXPECT_TRUE(std::any_of(pulses.begin(), pulses.end(), [&](const Json& p) { return p[0] == hand; }))
          << hand;
    for (const Json& pulse : pulses) {
      EXPECT_NEAR(pulse[1].get<double>(), closeness, 1e-6);
      EXPECT_GT(pulse[2].get<double>(), 0);
    }
  };
  put_on();
  limited_by("");  // from the first frame on: the pattern of a limit replaces the one of closeness
  enter_again();
  strength_of_all(0.6);
  strength_of_all(0.25);
  percept(0.0);
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.stage.poses.closeness === 0"); }));
  EXPECT_THAT(felt(), IsEmpty()) << "nothing is near";
  percept(0.9, false);
  ASSERT_TRUE(eventually([&] { return truth("!phantomScene.stage.poses.perceptKnown"); }));
  EXPECT_THAT(felt(), IsEmpty()) << "it is not valid";
  strength_of_all(0.5);
  percept(0.9, true, core::from_seconds(2 * config_.staleness.percept_s));
  ASSERT_TRUE(eventually([&] { return truth("!phantomScene.stage.poses.perceptKnown"); }));
  EXPECT_THAT(felt(), IsEmpty()) << "it is out of date";
  strength_of_all(0.7);
  browser_->run("phantomScene.connection.take = () => {}");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.connection.still"); }));
  ASSERT_TRUE(truth("phantomScene.stage.poses.perceptKnown")) << "the last that was heard";
  EXPECT_THAT(felt(), IsEmpty()) << "nothing comes any more";
}

TEST_F(SceneInHeadset, TheControllersTellWhatLimitsTheHandAndThePanelSaysIt) {
  enter();
  limited_by("");
  percept(0.25);
  const auto told = [this](const char* pulse) {
    return eventually([&] {
      return truth("felt.filter(([hand, strength, ms]) => hand === 'right' && " + std::string(pulse) +
                   ").length > 0");
    });
  };
  EXPECT_TRUE(told("strength < 0.3")) << "closeness";
  browser_->run("felt.length = 0");
  limited_by("limit.stopped");
  EXPECT_TRUE(told("strength === 1 && ms > 300")) << "one long pulse: a stop";
  EXPECT_TRUE(truth("phantomScene.headset.written.includes('A stop is in force')"));
  EXPECT_TRUE(truth("phantomScene.headset.beeper.context.state")) << "it has a sound of its own";
}

TEST_F(SceneInHeadset, ThePanelIsReadable) {
  enter();
  const auto written = [this] {
    browser_->run(
        "const { ink } = phantomScene.headset; window.texts = [];"
        "if (!window.fill) { window.fill = ink.fillText.bind(ink); ink.fillText = (text, x, y, most) => { fill(text, x, y, most);"
        "  texts.push([text, parseFloat(/(\\d+)px/.exec(ink.font)[1]), (most ?? 1e9) / ink.measureText(text).width, "
        "    x + Math.min(most ?? 1e9, ink.measureText(text).width), y]); }; }"
        "phantomScene.headset.written = null");
    EXPECT_TRUE(eventually([&] { return truth("phantomScene.headset.written"); }));
    return browser_->run("return texts");
  };
  const auto is_readable = [this](const Json& texts) {
    const Json panel = of(
        "({ m: [h.panel.geometry.parameters.width, h.panel.geometry.parameters.height], px: [h.ink.canvas.width, h.ink.canvas.height],"
        " away_m: h.panel.position.distanceTo(h.viewer), faces: h.viewer.clone().sub(h.panel.position).normalize()"
        ".dot(h.viewer.clone().set(0, 0, 1).applyQuaternion(h.panel.quaternion)) })");
    EXPECT_GT(panel["faces"].get<double>(), 0.999) << "it is turned to the eyes";
    const double m_per_px = panel["m"][1].get<double>() / panel["px"][1].get<double>();
    EXPECT_NEAR(m_per_px, panel["m"][0].get<double>() / panel["px"][0].get<double>(), 1e-9);
    double least_rad = INFINITY;
    for (const Json& text : texts) {
      const double capital_m = kCapital * text[1].get<double>() * m_per_px;
      least_rad = std::min(least_rad, capital_m / panel["away_m"].get<double>());
      EXPECT_GE(text[2].get<double>(), 0.8) << text << " is squeezed";
      EXPECT_LE(text[3].get<double>(), panel["px"][0].get<double>()) << text;
      EXPECT_LE(text[4].get<double>() + text[1].get<double>() / 2, panel["px"][1].get<double>()) << text;
    }
    std::cout << "headset: capitals of " << least_rad * 180 / M_PI << " deg at " << panel["away_m"] << " m\n";
    EXPECT_GE(least_rad, kReadable_rad);
  };
  const auto all = [](const Json& texts) {
    std::string one;
    for (const Json& text : texts) one += text[0].get<std::string>() + " ";
    return one;
  };
  browser_->run("headset.controllers.left.connected = false");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.headset.left === null"); }));
  const Json texts = written();
  EXPECT_THAT(all(texts), testing::AllOf(testing::HasSubstr("Closeness 0.60"), testing::HasSubstr("m/s")));
  is_readable(texts);  // ahead of the eyes, where it is farthest
  const cv::Mat with = picture("headset_panel");
  browser_->run("phantomScene.headset.panel.visible = false");
  const cv::Mat without = picture("headset_no_panel");
  EXPECT_GT(cv::norm(with, without, cv::NORM_L1) / 255 / (kWidth_px * kHeight_px), 0.001)
      << "it is in the picture";
  browser_->run(
      "phantomScene.headset.panel.visible = true; headset.controllers.left.connected = true;"
      "headset.controllers.left.position.set(-0.1, 1.3, -0.4)");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.headset.left"); }));
  frames(1);
  is_readable(texts);  // over the left hand
  browser_->run("headset.controllers.left.connected = false");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.headset.left === null"); }));
  browser_->run("phantomScene.connection.take = () => {}");
  ASSERT_TRUE(eventually([&] { return truth("phantomScene.connection.still"); }));
  frames(1);
  const Json still = written();
  EXPECT_THAT(all(still), testing::AllOf(testing::HasSubstr("STANDS STILL"), testing::HasSubstr("unknown"),
                                         testing::Not(testing::HasSubstr("0.60"))));
  is_readable(still);
  picture("headset_still");
}

}  // namespace
}  // namespace phantom::synthetic_viewer
