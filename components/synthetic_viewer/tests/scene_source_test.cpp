// Whose pictures the page shows: the browser's, or the viewer's where the browser cannot draw, draws too few
// or leaves bodies out, or by choice.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::SceneInChromium;
using SceneDrawing = SceneInChromium;

class SceneOfABadDriver : public SceneInChromium {
 protected:
  void draw_as_it_should() {
    open();
    ASSERT_TRUE(drawn());
    browser_->run(
        "window.gl = phantomScene.stage.renderer.getContext(); window.many = gl.getExtension('WEBGL_multi_draw');"
        "window.each = gl.drawElements; phantomScene.doubt();" +
        seen_);
    ASSERT_TRUE(eventually_whole());
  }
  bool eventually_whole() {
    return test::eventually([&] { return truth("phantomScene.whole === true"); });
  }
  bool eventually_says(const std::string& words) {
    return test::eventually([&] { return text("scene-source") == words; });
  }

  // A browser without a display now and then takes a page for one that nobody sees.
  const std::string seen_ =
      "for (const view of Object.values(phantomScene.views)) view.visible = true; phantomScene.draw();";
  // As of a driver that draws nothing of many items at once, and reports no error. Anew, as after a loss.
  const std::string none_of_many_ = "many.multiDrawElementsWEBGL = () => {}; phantomScene.doubt();";
};

// Tries synthetic_viewer: graphics that draw nothing of many bodies at once
TEST_F(SceneOfABadDriver, WhatIsNotDrawnAtOnceIsDrawnOneByOne) {
  draw_as_it_should();
  EXPECT_FALSE(truth("phantomScene.figures().one_by_one"));
  const int at_once = browser_->run("return phantomScene.calls").get<int>();
  browser_->run(
      "window.picture = () => { const c = phantomScene.views.main.canvas; return c.getContext('2d').getImageData(0, 0, c.width, c.height).data; };"
      "window.atOnce = picture();");
  browser_->run(none_of_many_ + seen_);
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.figures().one_by_one"); }));
  EXPECT_TRUE(eventually_whole());
  EXPECT_EQ(text("scene-source"), "Drawn in this browser");
  browser_->run(seen_);
  EXPECT_TRUE(
      test::eventually([&] { return browser_->run("return phantomScene.calls").get<int>() > at_once; }));
  const char* const other = "return picture().reduce((n, v, i) => n + (v !== atOnce[i]), 0) / atOnce.length";
  EXPECT_LT(browser_->run(other).get<double>(), 0.001) << "the picture is the same";
  // A section makes programs of their own, which draw one by one, too.
  browser_->run("phantomScene.stage.setCutting(true); phantomScene.doubt();" + seen_);
  EXPECT_TRUE(eventually_whole());
  // A context that is lost comes back with the same driver.
  browser_->run(
      "phantomScene.stage.setCutting(false); window.lose = gl.getExtension('WEBGL_lose_context'); lose.loseContext()");
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.lost"); }));
  browser_->run("lose.restoreContext()");
  EXPECT_TRUE(test::eventually([&] { return truth("!phantomScene.lost"); }));
  browser_->run("many = gl.getExtension('WEBGL_multi_draw');" + none_of_many_ + seen_);
  EXPECT_TRUE(eventually_whole());
  EXPECT_LT(browser_->run(other).get<double>(), 0.001) << "the picture is the same again";
}

// Tries synthetic_viewer: graphics that leave the bodies out of what the browser draws
TEST_F(SceneOfABadDriver, GraphicsThatLeaveTheBodiesOutAreNoticedAndTheViewersPicturesShown) {
  draw_as_it_should();
  browser_->run(none_of_many_ + "gl.drawElements = () => {};" + seen_);
  const std::string left_out = "Pictures from the server: this browser's graphics leave the bodies out";
  EXPECT_TRUE(eventually_says(left_out)) << text("scene-source");
  EXPECT_TRUE(truth("phantomScene.connection.scene === null")) << "what is not drawn does not come";
  // Whoever chooses the browser's nevertheless has them tried again, not shown.
  browser_->run(
      "window.tries = 0; const run = phantomScene.checkWhole; phantomScene.checkWhole = function () { run.call(this); if (this.whole === false) ++tries; }");
  browser_->run("document.getElementById('server-pictures').click();" + seen_);
  EXPECT_TRUE(test::eventually([&] { return truth("tries > 0"); }));
  EXPECT_TRUE(eventually_says(left_out)) << text("scene-source");
  browser_->run("gl.drawElements = each; document.getElementById('server-pictures').click()");
  EXPECT_TRUE(eventually_says("Drawn in this browser")) << text("scene-source");
  browser_->run(seen_);
  EXPECT_TRUE(eventually_whole());
}

// Tries synthetic_viewer: a browser without WebGL 2
TEST_F(SceneDrawing, WithoutWebGlTheViewersPicturesAreShown) {
  open({"--disable-3d-apis"});
  EXPECT_TRUE(test::eventually(
      [&] { return text("scene-source") == "Pictures from the server: this browser has no WebGL 2"; }));
  EXPECT_TRUE(test::eventually(
      [&] { return truth("document.getElementById('main-view').dataset.stream === 'stream/main'"); }));
  EXPECT_TRUE(truth("!document.getElementById('main-scene')"));
}

/// The cell whose arm moves, in a browser that has not been told who draws.
class SceneWithoutChoice : public SceneInChromium {
 protected:
  /// So long a few slow pictures may take, of software on a machine that may be busy.
  static constexpr double kMaxOfLooks_s = 180;
  /// Lets each picture take that long at least.
  void open_slow(int ms) {
    open_without_choice();
    ASSERT_TRUE(drawn());
    slow_down(ms);
    turn_arm(0.3);
  }
  void slow_down(int ms) {
    browser_->run(
        "const stage = phantomScene.stage, draw = Object.getPrototypeOf(stage).draw;"
        "stage.draw = function (...of) { draw.apply(this, of); for (const begun = performance.now(); performance.now() - begun < " +
        std::to_string(ms) + ";); }");
  }
  /// What keeps the browser from drawing, for who reads that it does not.
  std::string drawing() {
    return browser_->run(
        "const { shown, frame, pace, connection, views } = phantomScene;"
        "return JSON.stringify({ shown, frame, still: connection.still, hidden: document.hidden, pace,"
        "  views: Object.values(views).map(v => [v.name, v.drawn, v.visible, v.canvas.width]) })");
  }
  /// Waits until the pace was looked at so often since.
  bool looked(int times) {
    browser_->run("window.looks = phantomScene.pace.looks");
    return test::eventually(
        [&] { return truth("phantomScene.pace.looks >= window.looks + " + std::to_string(times)); },
        kMaxOfLooks_s);
  }
};

// Tries synthetic_viewer: a browser that draws few pictures itself
TEST_F(SceneWithoutChoice, ABrowserThatDrawsFewPicturesShowsTheViewersUnlessItsOperatorChooses) {
  open_slow(200);  // of three views
  EXPECT_TRUE(test::eventually(
      [&] {
        return text("scene-source").find("Pictures from the server: this browser draws too slowly (") == 0;
      },
      kMaxOfLooks_s))
      << text("scene-source") << drawing();
  EXPECT_TRUE(truth(
      "document.getElementById('main-view').offsetParent && !document.getElementById('main-scene').offsetParent"));
  EXPECT_TRUE(truth("phantomScene.connection.scene === null"));
  EXPECT_EQ(browser_->run("return document.getElementById('server-pictures').ariaPressed"), "true");
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
    std::ofstream(std::string(folder) + "/scene_slow.png", std::ios::binary) << browser_->screenshot();
  browser_->run("speak('de')");
  EXPECT_THAT(
      text("scene-source"),
      testing::ContainsRegex("^Bilder vom Server: dieser Browser zeichnet zu langsam .[0-9],[0-9]/s"));
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.tried"); }));
  EXPECT_TRUE(truth("phantomScene.slow")) << "the viewer's are more";

  browser_->click("#server-pictures");
  EXPECT_TRUE(test::eventually([&] { return text("scene-source") == "In diesem Browser gezeichnet"; }));
  ASSERT_TRUE(looked(4)) << drawing();
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.pace.few"); }));
  EXPECT_TRUE(truth("phantomScene.shown")) << "the choice prevails";
  browser_->open(server_->url());
  ASSERT_TRUE(drawn());
  slow_down(200);
  ASSERT_TRUE(looked(4)) << drawing();
  EXPECT_TRUE(truth("phantomScene.shown")) << "and is remembered";
}

TEST_F(SceneDrawing, ShowsTheViewersPicturesByChoiceAndNothingInAHiddenTab) {
  open();
  ASSERT_TRUE(drawn());
  browser_->click("#server-pictures");
  EXPECT_TRUE(test::eventually([&] { return text("scene-source") == "Pictures from the server"; }));
  EXPECT_TRUE(truth(
      "document.getElementById('main-view').offsetParent && !document.getElementById('main-scene').offsetParent"));
  EXPECT_TRUE(truth("phantomScene.connection.scene === null"));
  browser_->run(
      "window.cell = phantomScene.cell; window.stood = () => JSON.stringify(phantomScene.stage.bodies.map(b => b.elements));"
      "window.before = stood()");
  browser_->click("#server-pictures");
  EXPECT_TRUE(test::eventually([&] { return text("scene-source") == "Drawn in this browser"; }));
  ASSERT_TRUE(test::eventually([&] { return truth("phantomScene.cell !== cell"); }));
  EXPECT_TRUE(truth("stood() === before")) << "all stands where it stood, though nothing has moved since";
  browser_->run(
      "Object.defineProperty(document, 'hidden', { get: () => true, configurable: true });"
      "document.dispatchEvent(new Event('visibilitychange'))");
  EXPECT_TRUE(truth("!phantomScene.connection.open"));
  browser_->run("delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))");
  EXPECT_TRUE(test::eventually([&] { return truth("phantomScene.connection.open && phantomScene.shown"); }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
