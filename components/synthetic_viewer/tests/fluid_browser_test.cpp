// The fluid as a real Chromium draws it, against the voxels of the workspace that it stands in.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>

#include "components/synthetic_viewer/render/tests/project.hpp"
#include "components/synthetic_viewer/scene/tests/colour_vision.hpp"
#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::keep;
using test::SceneInChromium;
using test::unpacked;

/// The fluid of one object, its own picture, and where its voxels are.
class DrawnFluid : public SceneInChromium {
 protected:
  void show_fluid() {
    open();
    ASSERT_TRUE(drawn());
    browser_->click("#fluid");
    const auto fluids = workspace::fluids_of(*workspace_);
    const auto pump = std::ranges::find(fluids, id_of("pump"), &workspace::ObjectFluid::object);
    ASSERT_NE(pump, fluids.end());
    pump_ = *pump;
    ASSERT_TRUE(test::eventually([&] { return truth("phantomScene.stage.fluid.sectioned"); }));
  }
  std::uint16_t id_of(const std::string& name) const {
    for (const auto& [id, object] : state_.objects)
      if (object.name == name) return id;
    return 0;
  }
  /// Chooses, and waits until that is shown.
  void choose(const std::string& change) {
    browser_->run("phantomScene.fluid.choose(" + change + ")");
    ASSERT_TRUE(test::eventually([&] { return truth("!phantomScene.fluid.loading"); }));
    ASSERT_EQ(text("fluid-answer"), "");
  }
  /// Leaves nothing in the scene but one item, and no marks.
  void leave_only(const std::string& id) {
    browser_->run("const s = phantomScene.stage; for (const key of [...s.items.keys()]) if (key !== '" + id +
                  "') s.items.delete(key); s.poses = { ...s.poses, marks: [] }; s.update();");
  }
  cv::Mat picture(const std::string& first = "") {
    return unpacked(
        browser_
            ->run("const d = phantomScene, v = d.views.main, s = d.stage;" + first +
                  "Object.assign(v.canvas, {width: 1280, height: 720}); s.update();"
                  "s.draw('main', d.camera(v), v.context); return v.canvas.toDataURL('image/png')")
            .get<std::string>());
  }
  /// The pixels in which two pictures differ at all.
  static cv::Mat changed(const cv::Mat& a, const cv::Mat& b) {
    cv::Mat mask(a.rows, a.cols, CV_8U, cv::Scalar(0));
    for (int y = 0; y < a.rows; ++y)
      for (int x = 0; x < a.cols; ++x)
        for (int c = 0; c < 3; ++c)
          if (std::abs(a.ptr(y, x)[c] - b.ptr(y, x)[c]) > 2) mask.at<std::uint8_t>(y, x) = 255;
    return mask;
  }
  /// Numbers of pixels of `a`, and of those that `b` lacks.
  static std::pair<int, int> beyond(const cv::Mat& a, const cv::Mat& b) {
    int all = 0, lacking = 0;
    for (int y = 0; y < a.rows; ++y)
      for (int x = 0; x < a.cols; ++x)
        if (a.at<std::uint8_t>(y, x) != 0) ++all, lacking += b.at<std::uint8_t>(y, x) == 0 ? 1 : 0;
    return {all, lacking};
  }
  Eigen::Vector2d pixel_of(const Camera& camera, const Eigen::Vector3d& p_W_m) const {
    return project(camera, kSize.width_px, kSize.height_px, p_W_m).value_or(Eigen::Vector2d(-1e6, -1e6));
  }
  workspace::ObjectFluid pump_;
};

TEST_F(DrawnFluid, ThePanelHasRoomForItsWordsInBothLanguages) {
  show_fluid();
  browser_->show_on(1280, 720, false);
  choose(
      "{ object: 'pump', shells: 'all', plane: 'y', place_m: [0.4, -0.22, 0.4], opacity: 0.3, cut: true }");
  for (const char* language : {"de", "en"}) {
    browser_->run("speak('" + std::string(language) + "')");
    ASSERT_TRUE(test::eventually([&] { return truth("!phantomScene.frame"); }));
    const nlohmann::json clipped = browser_->run(
        "const panel = document.getElementById('fluid-panel').getBoundingClientRect();"
        "return [...document.querySelectorAll('#fluid-panel *')].filter(e => { const box = e.getBoundingClientRect();"
        "return e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0 || box.right > panel.right + 1 || box.bottom > innerHeight; })"
        ".map(e => e.id || e.className || e.textContent)");
    EXPECT_EQ(clipped.dump(), "[]") << language;
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::string(folder) + "/fluid_page_" + language + ".png", std::ios::binary)
          << browser_->screenshot();
  }
}

TEST_F(DrawnFluid, EachShellEnclosesTheOneWithinAndTheOutermostAllVoxels) {
  show_fluid();
  choose(
      "{ object: 'pump', shells: 'all', plane: 'y', place_m: [0.4, -0.22, 0.4], opacity: 0.9, cut: false }");
  ASSERT_TRUE(test::eventually([&] { return truth("!phantomScene.frame"); }));
  const nlohmann::json figures = browser_->run("return phantomScene.figures()");
  std::cout << "scene: with fluid and section " << figures.dump() << '\n';
  EXPECT_LE(figures.at("calls").get<int>(), 60);
  EXPECT_EQ(
      browser_
          ->run(
              "const l = [...document.querySelectorAll('#fluid-legend li')]; return l.map(e => e.textContent)")
          .dump(),
      R"(["Layer 6: 9.0 Pa·s/m","Layer 5: 10.0 Pa·s/m","Layer 4: 11.0 Pa·s/m","Layer 3: 13.0 Pa·s/m","Layer 2: 20.0 Pa·s/m",)"
      R"("Layer 1: 32.0 Pa·s/m","Body: 100.0 Pa·s/m"])");

  leave_only("object:" + std::to_string(pump_.object));
  const std::string no_object = "s.lines.visible = s.solid.mesh.visible = false;",
                    object = "s.solid.mesh.visible = true;";
  choose("{ shells: 'none', plane: 'none' }");
  const cv::Mat empty = picture(no_object), body = changed(empty, picture(object));
  cv::Mat within = body, outermost;
  int area = 0;
  for (const char* order : {"100", "1", "2", "3", "4", "5", "6"}) {
    choose(std::string("{ shells: '") + order + "' }");
    outermost = changed(empty, picture(no_object));
    const auto [all, lacking] = beyond(within, outermost);
    // A body of voxels ends within a voxel of the mesh; shells of voxels enclose each other wholly.
    EXPECT_LE(lacking, order[0] == '1' && order[1] == '0' ? all / 20 : all / 500) << "shell " << order;
    const int now = cv::countNonZero(outermost);
    std::cout << "scene: shell " << order << " covers " << now << " pixels\n";
    EXPECT_GT(now, area) << "shell " << order;
    area = now;
    within = outermost;
  }
  EXPECT_GT(area, 3 * cv::countNonZero(body) / 2);
  keep("fluid_outermost", outermost);

  // Every voxel is inside its silhouette, and none of that lies beyond them.
  const Camera camera = drawing_->picture(View::kMain).frame.camera;
  Eigen::AlignedBox2d corners, covered;
  int voxels = 0, outside = 0;
  const Eigen::Vector3d half_m = workspace_->grid().voxel_size_m.sides_m() / 2;
  pump_.box.for_each([&](workspace::Index3 v) {
    if (workspace_->object(v) != pump_.object || workspace_->order(v) == workspace::kOrderFree) return;
    const Eigen::Vector3d centre_m = workspace_->grid().centre_of(v);
    const Eigen::Vector2d at = pixel_of(camera, centre_m);
    ++voxels;
    if (outermost.at<std::uint8_t>(static_cast<int>(at.y()), static_cast<int>(at.x())) == 0) ++outside;
    for (int corner = 0; corner < 8; ++corner)
      corners.extend(pixel_of(
          camera, corner_of(Eigen::Vector3d(centre_m - half_m), Eigen::Vector3d(centre_m + half_m), corner)));
  });
  for (int y = 0; y < outermost.rows; ++y)
    for (int x = 0; x < outermost.cols; ++x)
      if (outermost.at<std::uint8_t>(y, x) != 0)
        covered.extend(Eigen::Vector2d(x, y)).extend(Eigen::Vector2d(x + 1, y + 1));
  EXPECT_GT(voxels, 10000);
  EXPECT_EQ(outside, 0);
  EXPECT_LE((corners.min() - covered.min()).cwiseAbs().maxCoeff(), 1.5);
  EXPECT_LE((corners.max() - covered.max()).cwiseAbs().maxCoeff(), 1.5);
}

TEST_F(DrawnFluid, ASectionHasTheColourOfEachVoxelsLayerAndCutsTheObjectOpen) {
  show_fluid();
  const std::string level =
      "{ object: 'pump', shells: 'none', plane: 'z', place_m: [0, 0, 0.46], cut: false }";
  choose(level);
  leave_only("object:" + std::to_string(pump_.object));
  const int at = workspace_->grid().index_of({0, 0, 0.46}).z;
  EXPECT_EQ(browser_->run("return +document.getElementById('fluid-place').value").get<int>(), at);
  const cv::Mat section = picture("s.solid.mesh.visible = s.lines.visible = false;");
  keep("fluid_section", section);
  const Camera camera = drawing_->picture(View::kMain).frame.camera;
  // By order, as the legend shows it.
  std::map<int, std::array<int, 3>> colours;
  for (const nlohmann::json& one :
       browser_->run("return [...document.querySelectorAll('#fluid-legend li')].map(e => [+e.dataset.order, "
                     "...getComputedStyle(e.firstChild).backgroundColor.match(/[0-9]+/g).map(Number)])"))
    colours[one[0].get<int>()] = {one[1].get<int>(), one[2].get<int>(), one[3].get<int>()};
  ASSERT_EQ(colours.size(), 7U);
  std::map<int, int> seen;  // cells, by order
  pump_.box.for_each([&](workspace::Index3 v) {
    if (v.z != at || workspace_->object(v) != pump_.object) return;
    const int order = workspace_->order(v);
    for (int x = -1; x <= 1; ++x)  // whose neighbours are of the same layer: a pixel is as large as a voxel
      for (int y = -1; y <= 1; ++y)
        if (const workspace::Index3 beside = v + workspace::Index3{x, y, 0};
            workspace_->order(beside) != order || workspace_->object(beside) != pump_.object)
          return;
    const Eigen::Vector2d place = pixel_of(camera, workspace_->grid().centre_of(v));
    const std::uint8_t* const bgr = section.ptr(static_cast<int>(place.y()), static_cast<int>(place.x()));
    const auto& expected = colours.at(order == workspace::kOrderInterior ? workspace::kOrderBoundary : order);
    for (std::size_t c = 0; c < 3; ++c)
      ASSERT_NEAR(bgr[2 - c], expected[c], 1) << "order " << order << " at " << v.x << ", " << v.y;
    ++seen[order];
  });
  for (const int order : {1, 2, 3, 4, 5, 6, 101}) EXPECT_GT(seen[order], 20) << "order " << order;
  for (const auto& [a, first] : colours)
    for (const auto& [b, second] : colours) {
      const auto linear = [](const std::array<int, 3>& c) {
        return test::LinearColour{std::pow(c[0] / 255.0, 2.2), std::pow(c[1] / 255.0, 2.2),
                                  std::pow(c[2] / 255.0, 2.2)};
      };
      if (a >= b) continue;
      EXPECT_GE(test::least_difference(linear(first), linear(second)), 6) << a << " and " << b;
    }

  // Cut open, of the object is left what lies under the plane; the arm is never cut.
  const std::string bare = "s.solid.mesh.visible = true; s.fluid.sectioned = false;";
  const cv::Mat whole = picture(bare), empty = picture("s.solid.mesh.visible = s.fluid.sectioned = false;");
  browser_->click("#fluid-cut");
  ASSERT_TRUE(test::eventually(
      [&] { return truth("phantomScene.stage.fluid.cutting.value && !phantomScene.fluid.loading"); }));
  const cv::Mat cut = picture(bare);
  const int of_whole = cv::countNonZero(changed(whole, empty)),
            of_cut = cv::countNonZero(changed(cut, empty));
  EXPECT_GT(of_cut, of_whole / 20);
  EXPECT_LT(of_cut, 9 * of_whole / 10);
  EXPECT_EQ(beyond(changed(cut, empty), changed(whole, empty)).second, 0);
  EXPECT_TRUE(truth("phantomScene.stage.solid.material.defines.CUT === 1"));

  // By keys alone, one voxel at a time; and the choices stay.
  browser_->run("document.getElementById('fluid-place').focus()");
  browser_->type({test::Browser::kLeft, test::Browser::kLeft});
  EXPECT_TRUE(test::eventually([&] {
    return truth("phantomScene.stage.fluid.section.material.uniforms.at.value === " + std::to_string(at - 2));
  }));
  EXPECT_NE(text("fluid-panel").find("z = "), std::string::npos);
  browser_->run("document.getElementById('fluid-plane').focus()");
  browser_->type({test::Browser::kDown, test::Browser::kHome, test::Browser::kEnter});
  EXPECT_TRUE(test::eventually([&] {
    return truth("!phantomScene.stage.fluid.sectioned && phantomScene.fluid.chosen.plane === 'none'");
  }));
  EXPECT_TRUE(truth("!phantomScene.stage.fluid.cutting.value")) << "without a section nothing is cut";
  browser_->open(server_->url());
  ASSERT_TRUE(drawn());
  EXPECT_TRUE(truth(
      "phantomScene.fluid.chosen.object === 'pump' && phantomScene.fluid.chosen.plane === 'none' && phantomScene.fluid.chosen.on"));
  // Another workspace is shown by itself.
  auto other = std::make_shared<workspace::Workspace>(*workspace_);
  for (const workspace::BrickKey& key : workspace_->bricks()) other->remove_brick(key);
  other->version = 2;
  other->fill_brick(workspace::BrickKey{{5, 5, 5}}, 1, 1, pump_.object);
  choose("{ shells: 'outer' }");
  {
    const std::lock_guard lock(mutex_);
    workspace_ = other;
  }
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.stage.fluid.count === 6"); }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
