// The page of candidates in a real Chromium: rendered, turned, picked.
#include <nlohmann/json.hpp>
#include <sstream>

#include "components/workspace_survey/tests/rig.hpp"

// After Eigen: it brings macros of the resolver that Eigen's names do not bear.
#include "components/synthetic_viewer/tests/web_driver.hpp"

namespace phantom::workspace_survey {
namespace {

using synthetic_viewer::test::Browser;

class CandidatesInChromium : public InFolder {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    Request request;
    request.what = "fit";
    request.library = source("deploy/parts");
    request.measurements = source("deploy/parts/measurements/refused_several_poses.csv");
    request.page = folder_ / "page.html";
    std::istringstream in;
    std::ostringstream print;
    run(request, shipped_config(), {}, in, print);
    browser_.emplace();
    browser_->open("file://" + request.page.string());
  }
  nlohmann::json js(const std::string& script) { return browser_->run(script); }
  std::string picture() { return js("return data.cards[0].canvas.toDataURL()").get<std::string>(); }
  std::optional<Browser> browser_;
};

TEST_F(CandidatesInChromium, EveryOneIsDrawnAsTheHeadSeesItAndTurnsWithTheOthers) {
  ASSERT_GE(js("return document.querySelectorAll('canvas').length").get<int>(), 2);
  EXPECT_EQ(js("return document.getElementById('view').getClientRects().length").get<int>(), 0)
      << "no picture of the cell was given";
  // A share of the picture is the part, and the measured corners lie on its silhouette's corners.
  const double covered =
      js("const c = data.cards[0].canvas, d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
         "let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n / d.length * 4");
  EXPECT_GT(covered, 0.1);
  EXPECT_LT(covered, 0.8);
  const double off_m =
      js("return Math.max(...data.cards.map(c => Math.max(...c.seen.measured.map(m => "
         "Math.min(...c.seen.nodes.map(n => Math.hypot(n[0] - m.at[0], n[1] - m.at[1])))))))");
  EXPECT_LT(off_m, 0.01);
  const std::string images =
      "return [...document.querySelectorAll('.card img')].filter(i => i.complete && i.naturalWidth > 0).length";
  EXPECT_EQ(js(images), js("return document.querySelectorAll('.card').length"))
      << "each has the picture that the library has of its part";
  const std::string at_home = picture();
  browser_->drag("canvas", 60, 25);
  const std::string turned = picture();
  EXPECT_NE(turned, at_home);
  EXPECT_LT(
      js("return Math.max(...data.cards[0].seen.vertices.map(v => Math.abs(Math.hypot(...v) - Math.hypot(...turn(v)))))")
          .get<double>(),
      1e-12)
      << "a turn, nothing else";
  browser_->click("#wire");
  EXPECT_NE(picture(), turned);
  browser_->click("#wire");
  browser_->click("#home");
  EXPECT_EQ(picture(), at_home);
}

TEST_F(CandidatesInChromium, AClickPicksAndSaysWhatToType) {
  browser_->click(".card:nth-child(2) button");
  EXPECT_TRUE(
      js("return document.querySelector('.card:nth-child(2)').classList.contains('picked')").get<bool>());
  EXPECT_TRUE(
      js("return document.getElementById('command').textContent").get<std::string>().ends_with("--pick 2"));
  browser_->click(".card:nth-child(1) button");
  EXPECT_EQ(js("return document.querySelectorAll('.picked').length").get<int>(), 1);
  EXPECT_TRUE(
      js("return document.getElementById('command').textContent").get<std::string>().ends_with("--pick 1"));
}

}  // namespace
}  // namespace phantom::workspace_survey
