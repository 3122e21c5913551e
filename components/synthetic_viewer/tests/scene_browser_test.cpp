// The scene as a real Chromium draws it, by software: the same picture as the viewer's, and what is said when
// it stands still.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "components/synthetic_viewer/render/tests/project.hpp"
#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::keep;
using test::SceneInChromium;
using test::unpacked;
using SceneDrawing = SceneInChromium;

constexpr int kOtherColour = 20;  // of 255

/// Returns whether a pixel differs from another picture's.
bool differs(const cv::Mat& a, const cv::Mat& b, int x, int y) {
  const std::uint8_t *p = a.ptr(y, x), *q = b.ptr(y, x);
  return std::max({std::abs(p[0] - q[0]), std::abs(p[1] - q[1]), std::abs(p[2] - q[2])}) > kOtherColour;
}

/// Returns the share of pixels that have the same colour in both pictures.
double same_colour(const cv::Mat& a, const cv::Mat& b) {
  int same = 0;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) same += differs(a, b, x, y) ? 0 : 1;
  return static_cast<double>(same) / (a.rows * a.cols);
}

struct Agreement {
  double all = 0.0;      ///< pixels that both pictures cover or neither, of all
  double covered = 0.0;  ///< pixels that both pictures cover, of those that one covers
};
/// Compares what is white.
Agreement silhouettes(const cv::Mat& a, const cv::Mat& b) {
  const auto white = [](const std::uint8_t* p) { return p[0] > 220 && p[1] > 220 && p[2] > 220; };
  int both = 0, one = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      const bool in_a = white(a.ptr(y, x)), in_b = white(b.ptr(y, x));
      both += in_a && in_b ? 1 : 0;
      one += in_a || in_b ? 1 : 0;
    }
  }
  return {1.0 - static_cast<double>(one - both) / (a.rows * a.cols),
          one > 0 ? static_cast<double>(both) / one : 0.0};
}

class DrawnByBoth : public SceneInChromium, public ::testing::WithParamInterface<View> {};

// The oracle: the viewer's picture of the same state by the same camera.
TEST_P(DrawnByBoth, TheBrowsersPictureIsTheViewersOne) {
  open();
  ASSERT_TRUE(drawn());
  const std::string view = name_of(GetParam());
  const auto picture = [&](const std::string& first) {
    return unpacked(browser_
                        ->run("const d = phantomScene, v = d.views['" + view + "'];" + first +
                              "Object.assign(v.canvas, {width: 1280, height: 720}); d.stage.update();"
                              "d.stage.draw('" +
                              view + "', d.camera(v), v.context); return v.canvas.toDataURL('image/png')")
                        .get<std::string>());
  };
  ASSERT_TRUE(test::eventually([&] { return truth("phantomScene.stage.paint.patch_m > 0"); }))
      << "the skin's paint";
  const cv::Mat browser = picture("");
  Frame frame = drawing_->picture(GetParam()).frame;
  const cv::Mat viewer = drawing_->renderer().render(frame, kSize);
  const Camera camera = frame.camera;
  for (DrawItem& item : frame.items) {
    item.colour = {1, 1, 1};
    item.own_light = item.opacity = 1;
    item.paint = kNoPaint;
    item.casts_shadow = false;
  }
  frame.lines.clear();
  const std::string whiten =
      "const white = { colour: [1, 1, 1], own_light: 1, ownLight: 1, opacity: 1, paint: null, shadow: false };"
      "for (const i of d.stage.items.values()) Object.assign(i, white); d.stage.lines.visible = false;"
      "const poses = d.stage.poses; d.stage.poses = { ...poses, marks: poses.marks.map(m => ({ ...m, ...white })) };";
  const cv::Mat viewer_white = drawing_->renderer().render(frame, kSize), browser_white = picture(whiten);
  keep("scene_" + view + "_browser", browser);
  keep("scene_" + view + "_viewer", viewer);
  ASSERT_EQ(browser.size(), viewer.size());
  const Agreement found = silhouettes(viewer_white, browser_white);
  const double colours = same_colour(viewer, browser);
  std::cout << "scene: " << view << ": silhouettes agree in " << found.all << " of all pixels, in "
            << found.covered << " of those covered; colours in " << colours << '\n';
  EXPECT_GE(found.all, 0.99);
  EXPECT_GE(found.covered, 0.97);
  EXPECT_GE(colours, 0.95);
  // A picture without every other thing is told apart.
  const Agreement without = silhouettes(
      viewer_white,
      picture(
          "let n = 0; for (const id of [...d.stage.items.keys()]) if (++n % 2) d.stage.items.delete(id);"));
  EXPECT_LT(without.covered, found.covered);

  const nlohmann::json matrices = browser_->run(
      "const c = phantomScene.stage.camera; return [c.projectionMatrix.elements, c.matrixWorldInverse.elements]");
  Eigen::Matrix4d part[2];
  for (int m = 0; m < 2; ++m)
    for (int i = 0; i < 16; ++i)
      part[m].data()[i] = matrices[static_cast<std::size_t>(m)][static_cast<std::size_t>(i)].get<double>();
  int seen = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p = corner_of(cell_.min_m, cell_.max_m, corner);
    const auto pixel = project(camera, kSize.width_px, kSize.height_px, p);
    if (!pixel) continue;
    ++seen;
    const Eigen::Vector4d clip = part[0] * part[1] * p.homogeneous();
    const Eigen::Vector2d drawn((clip.x() / clip.w() + 1) / 2 * kSize.width_px,
                                (1 - clip.y() / clip.w()) / 2 * kSize.height_px);
    // A corner far beyond the picture's border is as exact as float32 has it.
    EXPECT_LE((drawn - *pixel).norm(), std::max(1.0, 1e-3 * pixel->norm())) << "corner " << corner;
  }
  EXPECT_GT(seen, 0);
}
INSTANTIATE_TEST_SUITE_P(Scene, DrawnByBoth, ::testing::Values(View::kMain, View::kHit, View::kTool),
                         [](const auto& view) { return std::string(name_of(view.param)); });

/// The still scene with three threats at once, and a pump of which nobody knows well where it is.
class SceneOfThreats : public SceneInChromium {
 protected:
  void SetUp() override {
    SceneInChromium::SetUp();
    if (IsSkipped()) return;
    threaten("lead_wall", 4, 0.42, percept::HitRule::kFarNearing);
    threaten("work_table", 6, 0.55, percept::HitRule::kFarNearing);
    threaten("pump", 7, 0.18, percept::HitRule::kVeryClose);
    std::ranges::sort(state_.percept.threats, {},
                      [](const messages::Threat& one) { return one.contact.time_s; });
    const ObjectSample& pump = object("pump");
    state_.uncertainties[pump.id] = {pump.id, 0.03, 0.03};
    DoubtSample doubt;
    doubt.doubt = 1;
    doubt.holds = true;
    doubt.link = 7;
    doubt.link_name = "gripper";
    doubt.object = pump.id;
    doubt.position_m = state_.percept.position_m;
    doubt.located = doubt.residual_known = true;
    doubt.force_N = 14.0;
    doubt.residual_m = 0.028;
    doubt.shift_m = {0.0, 0.0, 0.028};
    state_.take(doubt);
    state_.percept.condition = messages::PerceptCondition::kModelInDoubt;
    drawing_->advance(core::monotonic_ns(), 0.1);
    content_.scene.publish(drawing_->scene_base());
  }
  const ObjectSample& object(const std::string& name) const {
    return std::ranges::find_if(state_.objects, [&](const auto& one) { return one.second.name == name; })
        ->second;
  }
  void threaten(const std::string& name, std::uint32_t link, double contact_s, percept::HitRule rule) {
    const ObjectSample& at = object(name);
    messages::Threat threat;
    threat.rule = rule;
    threat.raises = true;
    threat.link = link;
    threat.object = at.id;
    threat.speed_m_s = 0.2;
    threat.contact = {contact_s, 0.05, 0.2 * contact_s};
    state_.percept.threats.push_back(threat);
    HitSample hit = state_.hits.front().raised;
    hit.alert = 10 + link;
    hit.rule = rule;
    hit.link = link;
    hit.link_name = drawing_->scene().link_name(link);
    hit.object = at.id;
    hit.contact = threat.contact;
    state_.take(hit);
    drawing_->take(hit);
  }
};

TEST_F(SceneOfThreats, ShowsAllThreeWithTheirSecondsAndWhereTheModelIsInDoubt) {
  open();
  ASSERT_TRUE(drawn());
  const auto words = [&](const std::string& selector) {
    return browser_->run("return [...document.querySelectorAll('" + selector + "')].map(i => i.textContent)")
        .get<std::vector<std::string>>();
  };
  using testing::AllOf, testing::ElementsAre, testing::HasSubstr;
  ASSERT_TRUE(test::eventually([&] { return words("#threats > *").size() == 3; }));
  EXPECT_THAT(words("#threats > *"), ElementsAre(AllOf(HasSubstr("pump"), HasSubstr("0.2")),
                                                 AllOf(HasSubstr("lead_wall"), HasSubstr("0.4")),
                                                 AllOf(HasSubstr("work_table"), HasSubstr("0.6"))));
  EXPECT_THAT(words("#doubts > *"), ElementsAre(HasSubstr("28 mm")));
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    std::ofstream(std::string(folder) + "/threats.png", std::ios::binary) << browser_->screenshot();
}

TEST_F(SceneDrawing, ComesByFewDrawCallsAndFewOctets) {
  open();
  ASSERT_TRUE(drawn());
  turn_arm(0.3);
  EXPECT_EQ(text("scene-source"), "Drawn in this browser");
  ASSERT_TRUE(test::eventually([&] { return truth("phantomScene.figures().frames > 15"); }));
  const nlohmann::json figures = browser_->run("return phantomScene.figures()");
  std::cout << "scene: " << figures.dump() << '\n';
  EXPECT_LE(figures.at("calls").get<int>(), 60);
  EXPECT_GT(figures.at("calls").get<int>(), 3);
  const double loaded =
      browser_
          ->run(
              "return performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'))"
              ".filter(e => !e.name.includes('/stream/')).reduce((sum, e) => sum + e.transferSize, 0)")
          .get<double>();
  std::cout << "scene: " << loaded << " octets loaded\n";
  EXPECT_LE(loaded + figures.at("bytes").get<double>(), 3e6);
  EXPECT_GT(loaded, 1e5);
  EXPECT_TRUE(truth(
      "document.getElementById('main-scene').offsetParent && !document.getElementById('main-view').offsetParent"));
  browser_->run("document.getElementById('hit-count').textContent = ''");
  EXPECT_TRUE(test::eventually([&] { return text("hit-count") == "1"; }))
      << "the page shows its numbers to the last";
  EXPECT_THAT(
      browser_->run("return document.querySelector('.main-view .scene-note').textContent").get<std::string>(),
      testing::ContainsRegex("pose [0-9]+ ms old when drawn"));
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    std::ofstream(std::string(folder) + "/scene_page.png", std::ios::binary) << browser_->screenshot();
}

TEST_F(SceneDrawing, TurnsByTheHandOfItsOwnViewer) {
  open();
  ASSERT_TRUE(drawn());
  browser_->drag("#main-scene", 80, 40);
  EXPECT_TRUE(truth(
      "phantomScene.views.main.offset.azimuth_rad < -0.1 && phantomScene.views.main.offset.elevation_rad > 0.05"));
  browser_->wheel("#main-scene", -100);
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.views.main.offset.zoom < 1"); }));
  EXPECT_TRUE(test::eventually([&] {  // ears and hand go by the viewer's camera
    const std::lock_guard lock(mutex_);
    return std::any_of(requests_.begin(), requests_.end(), [](const ViewRequest& r) {
      return r.view == View::kMain && r.home && r.azimuth_rad < -0.1 && r.elevation_rad > 0.05 && r.zoom < 1;
    });
  }));
  ASSERT_TRUE(
      test::eventually([&] { return truth("!document.querySelector('[data-tools=main] .home').hidden"); }));
  browser_->open_window(server_->url());
  ASSERT_TRUE(drawn());
  EXPECT_TRUE(truth("!phantomScene.views.main.offset.moved"))
      << "another viewer's camera stands where it stood";
  browser_->run("document.getElementById('main-scene').focus()");
  browser_->type({test::Browser::kLeft, "+"});
  EXPECT_TRUE(
      truth("phantomScene.views.main.offset.azimuth_rad < 0 && phantomScene.views.main.offset.zoom < 1"));
  browser_->type({test::Browser::kHome});
  EXPECT_TRUE(truth("!phantomScene.views.main.offset.moved"));
  browser_->run(  // two fingers move apart
      "const c = document.getElementById('hit-scene'), at = (type, id, x) => c.dispatchEvent(new PointerEvent(type, "
      "{pointerId: id, button: 0, clientX: x, clientY: 50, pointerType: 'touch', bubbles: true}));"
      "c.setPointerCapture = () => {}; at('pointerdown', 11, 50); at('pointerdown', 12, 100); at('pointermove', 12, 150);");
  EXPECT_TRUE(truth("Math.abs(phantomScene.views.hit.offset.zoom - 0.5) < 1e-6"));
}

// Tries synthetic_viewer: a stream that stands still
// Tries synthetic_viewer: a browser to which no scene comes
TEST_F(SceneDrawing, SaysWithinHalfASecondThatItStandsStill) {
  open();
  ASSERT_TRUE(drawn());
  browser_->run(
      "window.at = {}; const mark = document.querySelector('.main-view .scene-still');"
      "new MutationObserver(() => { window.at[mark.hidden ? 'goes' : 'stands'] ||= performance.now(); }).observe(mark, "
      "{ attributes: true });"
      "const c = phantomScene.connection, hear = c.take, expect = c.expect; "
      "c.take = data => { if (!window.deaf) hear.call(c, data); };"
      "c.expect = () => { window.at.last = performance.now(); expect.call(c); };");  // it counts from poses
  ASSERT_TRUE(test::eventually([&] { return truth("window.at.last > 0"); }));
  browser_->run("window.at = { last: window.at.last }; window.deaf = true");
  ASSERT_TRUE(test::eventually([&] { return truth("window.at.stands > 0"); }));
  // How late a timer fires on a busy machine is the machine's; when it is due is ours.
  std::cout << "scene: told after " << browser_->run("return window.at.stands - window.at.last").get<double>()
            << " ms\n";
  EXPECT_GE(browser_->run("return window.at.stands - window.at.last").get<double>(), 400);
  EXPECT_TRUE(
      truth("document.querySelector('.main-view .scene-still').textContent.includes('STANDS STILL')"));
  EXPECT_TRUE(test::eventually([&] {
    return text("scene-source").find("the scene does not come") != std::string::npos;
  })) << "the viewer's pictures come in its place";
  EXPECT_TRUE(truth("document.querySelector('.main-view .scene-still').hidden"));
  browser_->run("window.deaf = false");
  EXPECT_TRUE(test::eventually([&] { return text("scene-source") == "Drawn in this browser"; }));
  browser_->run(
      "window.at.stands = 0; window.at.lost = performance.now(); phantomScene.connection.socket.close()");
  EXPECT_TRUE(test::eventually([&] {
    return truth("phantomScene.connection.open && !phantomScene.connection.still");
  })) << "a lost connection is opened again";
}

// Tries synthetic_viewer: a browser that is too busy to read
TEST_F(SceneDrawing, ReadsWhatCameWhileItWasBusyBeforeItSaysThatThePictureStandsStill) {
  open();
  ASSERT_TRUE(drawn());
  browser_->run(
      "const c = window.c = phantomScene.connection; window.hear = c.take.bind(c);"
      "window.mark = document.querySelector('.main-view .scene-still');"
      "c.take = data => { if (typeof data !== 'string' && new Uint8Array(data)[0] === 1) window.last = data; hear(data); }");
  ASSERT_TRUE(test::eventually([&] { return truth("window.last"); }));
  browser_->run(  // what waits in the socket is read after the alarm's timer, which is due meanwhile
      "c.take = () => {}; c.expect(); for (const begun = performance.now(); performance.now() - begun < 1000;);"
      "setTimeout(() => { window.stood = c.still || !mark.hidden; c.take = hear; hear(last); window.stands = c.still; }, 30)");
  ASSERT_TRUE(test::eventually([&] { return truth("window.stands !== undefined"); }));
  EXPECT_FALSE(truth("stood"));
  EXPECT_FALSE(truth("stands"));

  bool in_time = false;  // unless the browser was busy
  EXPECT_TRUE(test::eventually([&] {
    browser_->run(
        "window.seen = null; c.take = () => {}; c.expect(); const begun = performance.now();"
        "setTimeout(() => { seen = { shown: c.still && !mark.hidden, readings: c.readings }; }, 500)");
    EXPECT_TRUE(test::eventually([&] { return truth("seen"); }));
    const nlohmann::json seen = browser_->run("return seen");
    in_time = seen["shown"].get<bool>();
    EXPECT_TRUE(in_time || seen["readings"].get<int>() > 0) << seen;
    EXPECT_TRUE(test::eventually([&] { return truth("c.still"); })) << "also of a browser that is busy";
    return in_time;
  })) << "within half a second";
}

TEST_F(SceneDrawing, DoesNotGrowHoweverLongItIsShown) {
  open();
  ASSERT_TRUE(drawn());
  // What thousands of messages do, drawn or not: poses, paint that changes, and an object that goes and
  // comes.
  const std::string rounds =
      "const d = phantomScene, item = [...d.stage.items.values()].find(i => i.id.startsWith('object')), message = { ...item },"
      "mesh = d.stage.meshes.get(item.mesh);"
      "for (let i = 0; i < 1500; ++i) {"
      "  d.stage.setPoses({ ...d.stage.poses, number: i });"
      "  d.stage.setPaint({ patch_m: 0.02, patches: [{ link: 5, closeness: i % 2, middle_m: [0, 0, 0.001 * (i % 50)] }] });"
      "  if (i % 5 === 0) d.stage.setItem({ type: 'item', id: message.id, gone: true }), d.stage.update();"
      "  if (i % 5 === 1) d.stage.setItem({ ...message, mesh: message.mesh }), d.stage.addMesh(message.mesh, mesh);"
      "  d.stage.update();"
      "  if (i % 50 === 0) d.stage.draw('main', d.camera(d.views.main), d.views.main.context);"
      "} gc(); const { geometries, textures, programs } = d.figures();"
      "return { heap: performance.memory.usedJSHeapSize, geometries, textures, programs, items: d.stage.items.size, "
      "vertices: d.stage.solid.mesh.geometry.getAttribute('position').count, places: d.stage.solid.items.length }";
  browser_->run(rounds);
  const nlohmann::json first = browser_->run(rounds), second = browser_->run(rounds);
  std::cout << "scene: " << first.dump() << "\nscene: " << second.dump() << '\n';
  for (const char* what : {"geometries", "textures", "programs", "items", "vertices", "places"})
    EXPECT_EQ(first.at(what), second.at(what)) << what;
  EXPECT_LT(second.at("heap").get<double>() - first.at("heap").get<double>(), 1e6);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
