// Known corners for a camera's pose, chosen in the model as a real Chromium draws it.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "components/synthetic_viewer/render/tests/project.hpp"
#include "components/synthetic_viewer/scene/tests/picks_of_a_page.hpp"
#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// The panel in which a real camera's pose is found, beside the model that the browser draws.
class CornersOfTheModel : public SceneInChromium {
 protected:
  void open_panel() {
    calibration_.show(test::corners_of(cell_), {});
    content_.calibration = &calibration_;
    open();
    ASSERT_TRUE(drawn());
    browser_->run("document.getElementById('calibrate').click()");
    ASSERT_TRUE(test::eventually([&] {
      return truth("document.querySelectorAll('#calibration-model .marks i').length > 20");
    })) << text("calibration-words");
  }
  nlohmann::json size() {
    return browser_->run(
        "const c = document.querySelector('#calibration-model canvas'); return [c.clientWidth, c.clientHeight]");
  }
  /// Clicks into the model, and returns what is said then.
  std::string click_at(double x, double y) {
    return browser_
        ->run(
            "const c = document.querySelector('#calibration-model canvas'), box = c.getBoundingClientRect(), at = { "
            "clientX: box.left + " +
            std::to_string(x) + ", clientY: box.top + " + std::to_string(y) +
            ", button: 0, pointerId: 1, bubbles: true }; c.setPointerCapture = () => {};"
            "c.dispatchEvent(new PointerEvent('pointerdown', at)); c.dispatchEvent(new PointerEvent('pointerup', at));"
            "c.dispatchEvent(new MouseEvent('click', at)); return document.getElementById('calibration-words').textContent")
        .get<std::string>();
  }
  std::string press(const std::string& key, bool shift = false) {
    return browser_
        ->run(
            "document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: '" + key +
            "', shiftKey: " + (shift ? "true" : "false") +
            ", bubbles: true, cancelable: true })); return document.getElementById('calibration-words').textContent")
        .get<std::string>();
  }
  std::string chosen() {
    return browser_
        ->run(
            "return document.querySelector('#calibration-corners [aria-pressed=true]')?.dataset.corner ?? ''")
        .get<std::string>();
  }
  const VideoCamera camera_ = load_video_camera(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/camera_gate.yaml");
  PoseCalibration calibration_{camera_, 960, 540};
};

TEST_F(CornersOfTheModel, AreChosenByAClickOnTheModelOrByKeysInBothLanguages) {
  open_panel();
  const nlohmann::json told = nlohmann::json::parse(calibration_.state_json(1));
  const int width = size()[0].get<int>(), height = size()[1].get<int>();
  const Camera camera = drawing_->picture(View::kMain).frame.camera;
  const auto shown_at = [&](const Eigen::Vector3d& place_m) {
    return project(camera, width, height, place_m);
  };
  const auto place_of = [](const nlohmann::json& corner) {
    return Eigen::Vector3d(corner["place_m"][0].get<double>(), corner["place_m"][1].get<double>(),
                           corner["place_m"][2].get<double>());
  };
  // Each corner that nothing hides from the main view's eye, and that stands clear of the others, is chosen
  // by a click at its place.
  constexpr double kClear_px = 3.0, kHides_m = 0.02;
  const Eigen::Vector3d eye_m = camera.eye_m;
  std::vector<Eigen::Vector2d> places;
  for (const nlohmann::json& corner : told["corners"])
    places.push_back(shown_at(place_of(corner)).value_or(Eigen::Vector2d(-99, -99)));
  int clicked = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d way_m = place_of(told["corners"][i]) - eye_m;
    const bool in_picture =
        places[i].minCoeff() > 2 && places[i].x() < width - 2 && places[i].y() < height - 2;
    const bool hidden =
        drawing_->bodies().nearest(eye_m, way_m.normalized(), 0.01, way_m.norm() - kHides_m).has_value();
    const auto beside = [&](const Eigen::Vector2d& other) {
      return &other != &places[i] && (other - places[i]).norm() < kClear_px;
    };
    if (!in_picture || hidden || std::ranges::any_of(places, beside)) continue;
    const std::string words = click_at(places[i].x(), places[i].y()), name = told["corners"][i]["name"];
    EXPECT_EQ(chosen(), name);
    EXPECT_NE(words.find(" is chosen: click where you see it"), std::string::npos) << words;
    ++clicked;
  }
  EXPECT_GE(clicked, 15);
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    std::ofstream(std::string(folder) + "/calibration_model.png", std::ios::binary) << browser_->screenshot();

  // On an object, away from all corners: one of that object's.
  int objects = 0;
  for (const runtime::CellBody& body : runtime::load_bodies(cell_)) {
    const runtime::ObjectConfig& object = cell_.objects[body.body.id - 1U];
    const auto of_it = [&](const nlohmann::json& corner) {
      return corner["name"].get<std::string>().starts_with(object.name + ":");
    };
    if (std::ranges::none_of(told["corners"], of_it)) continue;
    for (const Eigen::Vector3f& vertex_m : body.mesh_O.vertices_m) {
      const Eigen::Vector3d at_m = object.X_WO * vertex_m.cast<double>(), way_m = at_m - eye_m;
      const auto at = shown_at(at_m);
      const auto beside = [&](const Eigen::Vector2d& place) { return (place - *at).norm() < 10; };
      if (!at || std::ranges::any_of(places, beside) ||
          drawing_->bodies().nearest(eye_m, way_m.normalized(), 0.01, way_m.norm() - 1e-3))
        continue;
      click_at(at->x(), at->y());
      if (!chosen().starts_with(object.name + ":")) continue;  // at an outline a click may go by
      ++objects;
      break;
    }
  }
  EXPECT_GE(objects, 4);
  const std::string last = chosen();
  EXPECT_EQ(click_at(width / 2.0, 2), "There is no corner that the camera sees")
      << "above all that stands there";
  EXPECT_EQ(chosen(), last);

  // By keys: arrows go from corner to corner, Enter on to the picture; with Shift they turn the model.
  browser_->run("document.querySelector('#calibration-model canvas').focus()");
  const auto across = [&] {
    return browser_->run("return parseFloat(document.querySelector('#calibration-model .chosen').style.left)")
        .get<double>();
  };
  const double before = across();
  press("ArrowLeft");
  EXPECT_NE(chosen(), last);
  EXPECT_LT(across(), before);
  EXPECT_TRUE(truth("!phantomScene.page.corners.offset.moved"));
  press("ArrowLeft", true);
  EXPECT_TRUE(truth("phantomScene.page.corners.offset.moved"));
  press("Enter");
  EXPECT_TRUE(truth("document.activeElement.id === 'calibration-picture'"));
  browser_->run("speak('de'); document.querySelector('#calibration-model canvas').focus()");
  EXPECT_NE(press("ArrowLeft").find("ist gewählt: Klicken Sie"), std::string::npos);
  EXPECT_TRUE(truth(
      "document.querySelector('#calibration-model canvas').getAttribute('aria-label').startsWith('Das Modell.')"));
  browser_->click("#calibration-close");
  EXPECT_TRUE(truth("document.getElementById('calibration-model').hidden"));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
