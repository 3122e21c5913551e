// The operator's page for everyone: in two languages, by keyboard alone, by fingers, with any colour vision.
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "components/synthetic_viewer/scene/tests/colour_vision.hpp"
#include "components/synthetic_viewer/tests/page_in_chromium.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;

class PageForEveryone : public test::PageInChromium {
 protected:
  void serve_in(const std::string& language) {
    browser_arguments_ = {"--accept-lang=" + language};
    gripper_ = true;
    serve(true);
    ASSERT_TRUE(
        eventually([&] { return truth("state && state.link.slave === 'COUPLED' && state.gripper"); }));
    ASSERT_TRUE(
        eventually([&] { return truth("document.querySelectorAll('#joints .joint').length === 6"); }));
  }
  void keep(const std::string& name) {
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"))
      std::ofstream(std::string(folder) + "/" + name + ".png", std::ios::binary) << browser_->screenshot();
  }
  /// What a file of tests/page_checks.js finds; each an entry of a list of problems.
  nlohmann::json problems(const std::string& check) {
    std::ifstream file(PHANTOM_SOURCE_DIR "/components/synthetic_viewer/tests/page_checks.js");
    const std::string script{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    return browser_->run(script + "\nreturn " + check + ";");
  }
  void stop_without_answer() {
    inbox_.stops.take_request(teleop::CommandAnswers(true, true, core::monotonic_ns()));
    ASSERT_TRUE(eventually(
        [&] { return truth("document.getElementById('stop-board').classList.contains('alarm')"); }));
  }
  std::size_t stops_heard() {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(
        std::count_if(commands_.begin(), commands_.end(),
                      [](const Command& command) { return command.kind == CommandKind::kEmergencyStop; }));
  }
};

TEST_F(PageForEveryone, EveryWordOnThePageIsFromTheTextsOrTheSystem) {
  serve_in("en");
  stop_without_answer();
  EXPECT_EQ(problems("foreignWords()"), nlohmann::json::array());
}

TEST_F(PageForEveryone, TheKeyboardComesEverywhereInOrderAndIsSeen) {
  serve_in("en");
  ASSERT_TRUE(eventually([&] { return truth("document.querySelectorAll('#alarms a').length === 1"); }))
      << "the alarm's link is a control, too";
  browser_->run("document.getElementById('settings').hidden = false");  // the focus stays at the beginning
  EXPECT_EQ(problems("watchFocus()"), nlohmann::json::array());
  const int controls = browser_->run("return focusOrder().length").get<int>();
  EXPECT_GT(controls, 25);
  browser_->type(std::vector<std::string>(static_cast<std::size_t>(controls), Browser::kTab));
  EXPECT_EQ(browser_->run("return focusProblems()"), nlohmann::json::array());
  browser_->run("document.getElementById('settings').hidden = true; document.getElementById('node').focus()");
  browser_->type({Browser::kDown, Browser::kDown, Browser::kEnter});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kViewNode, 9); })) << "a choice by keys";
}

TEST_F(PageForEveryone, EscStopsFromEverywhere) {
  serve_in("en");
  browser_->run("openDrawer('settings')");
  std::size_t heard = 0;
  const auto stops = [&](const std::string& where) {
    browser_->type({Browser::kEscape});
    ++heard;
    EXPECT_TRUE(eventually([&] { return stops_heard() >= heard; })) << where;
    heard = stops_heard();
    ASSERT_TRUE(eventually([&] { return truth("stopAsked === 0"); }));
  };
  for (const char* id : {"gain", "gripper-width", "main-view", "languages", "carry-object"}) {
    browser_->run("document.getElementById('" + std::string(id) + "').focus()");
    stops(id);
  }
  browser_->click("#law");
  ASSERT_TRUE(truth("!document.getElementById('law-list').hidden"));
  stops("an open choice");
  browser_->click("#reset");
  ASSERT_TRUE(truth("document.activeElement.id === 'reset-no'"));
  stops("the question before a reset");
  EXPECT_TRUE(truth("document.getElementById('reset-question').hidden"));
  EXPECT_FALSE(commanded(CommandKind::kReset, 0));
}

TEST_F(PageForEveryone, WhatMattersFitsEveryDeskWithoutScrolling) {
  serve_in("de");
  for (const auto& [width, height] :
       std::vector<std::pair<int, int>>{{2560, 1440}, {1920, 1080}, {1024, 768}, {768, 1024}, {1280, 720}}) {
    browser_->show_on(width, height, false);
    for (const std::string language : {"de", "en"}) {
      browser_->run("speak('" + language + "')");
      const std::string which = std::to_string(width) + "x" + std::to_string(height) + "_" + language;
      EXPECT_EQ(problems("outOfSight(kDesk)"), nlohmann::json::array()) << which;
      keep("desk_" + which);
    }
  }
  browser_->run("openDrawer('settings')");
  for (const std::string language : {"de", "en"}) {
    browser_->run("speak('" + language + "')");
    EXPECT_EQ(problems("outOfSight([...kDesk, ...kSettings])"), nlohmann::json::array()) << language;
    keep("settings_" + language);
  }
  browser_->run("openDrawer('settings')");
  stop_without_answer();
  for (const std::string language : {"de", "en"}) {
    browser_->run("speak('" + language + "')");
    EXPECT_EQ(problems("outOfSight([...kDesk, 'stop-headline', 'stop-master', 'stop-slave', 'stop-reset'])"),
              nlohmann::json::array())
        << language << ", while a stop is not confirmed";
    keep("desk_stop_" + language);
  }
}

TEST_F(PageForEveryone, TheLargeViewIsChosenByKeyAndTheChoiceIsKept) {
  serve_in("en");
  const auto wide = [&](const std::string& view) {
    return browser_
        ->run("return document.getElementById('" + view + "-figure').getBoundingClientRect().width")
        .get<double>();
  };
  EXPECT_GT(wide("main"), 2 * wide("hit"));
  browser_->type({"x"});  // nothing is in focus: the hit zone
  EXPECT_TRUE(eventually([&] { return wide("hit") > 2 * wide("main"); }));
  browser_->type({"z"});
  EXPECT_TRUE(eventually([&] { return wide("main") == 0; }));
  browser_->run("location.reload()");
  EXPECT_TRUE(eventually([&] { return truth("document.readyState === 'complete' && state"); }));
  EXPECT_TRUE(eventually([&] { return wide("main") == 0 && wide("hit") > 600; })) << "the choice is kept";
  browser_->type({"z"});
  browser_->run("setLarge('main')");
  EXPECT_TRUE(eventually([&] { return wide("main") > 2 * wide("hit"); }));
}

TEST_F(PageForEveryone, AWindowOfItsOwnShowsOneViewAndStops) {
  serve_in("en");
  browser_->open(server_->url() + "?view=hit");
  ASSERT_TRUE(eventually([&] { return truth("document.getElementById('hit-view').naturalWidth > 0"); }));
  for (const char* id : {"main-figure", "tool-figure", "alarm-panel", "settings-open"})
    EXPECT_TRUE(truth("document.getElementById('" + std::string(id) + "').offsetParent === null")) << id;
  EXPECT_EQ(problems("outOfSight(['hit-figure', 'stop'])"), nlohmann::json::array());
  keep("alone");
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return stops_heard() >= 1; }));
}

TEST_F(PageForEveryone, ADetachedViewIsShownInItsWindowAloneAndComesBackWithItsEnd) {
  serve_in("en");
  const std::string desk = browser_->window();
  const auto place = [&] {
    return browser_->run("return document.getElementById('hit-figure').dataset.place").get<std::string>();
  };
  for (const bool by_key : {true, false}) {
    ASSERT_EQ(place(), "side1");
    if (by_key) {
      browser_->type({"p"});
    } else {
      browser_->hover("#hit-view");
      EXPECT_TRUE(eventually([&] {
        return truth("getComputedStyle(document.querySelector('#hit-figure .detach')).opacity === '1'");
      })) << "the pointer over a view shows its button";
      keep("hovered");
      browser_->click("#hit-figure .detach");
    }
    std::string own;
    ASSERT_TRUE(eventually([&] {
      for (const std::string& handle : browser_->windows())
        if (handle != desk) own = handle;
      return !own.empty();
    }));
    EXPECT_TRUE(eventually([&] { return place() == "none"; }));
    browser_->switch_to(own);
    ASSERT_TRUE(eventually([&] {
      return truth(
          "document.body?.classList.contains('alone') && document.getElementById('hit-view')?.naturalWidth > 0");
    }));
    browser_->run("setTimeout(() => close(), 50)");
    browser_->switch_to(desk);
    EXPECT_TRUE(eventually([&] { return place() == "side1"; }));
    EXPECT_TRUE(truth("JSON.parse(localStorage.getItem('phantom.window.hit'))?.width > 0"))
        << "where it stood is kept for the next time";
  }
}

TEST_F(PageForEveryone, TabletsAndPhonesHaveRoomForFingersAndScrollOneWayOnly) {
  serve_in("de");
  for (const auto& [width, height] :
       std::vector<std::pair<int, int>>{{768, 1024}, {1024, 768}, {390, 844}, {1280, 800}}) {
    browser_->show_on(width, height, true);
    for (const std::string language : {"en", "de"}) {
      browser_->run("speak('" + language + "')");
      const std::string which = std::to_string(width) + "x" + std::to_string(height) + "_" + language;
      EXPECT_EQ(problems("tooSmallOrTooWide()"), nlohmann::json::array()) << which;
      keep("touch_" + which);
      browser_->run("openDrawer('settings')");
      EXPECT_EQ(problems("tooSmallOrTooWide()"), nlohmann::json::array()) << which << ", settings";
      browser_->run("openDrawer('settings')");
    }
  }
}

TEST_F(PageForEveryone, TwoFingersZoomAndTurnAView) {
  serve_in("en");
  browser_->show_on(768, 1024, true);
  const auto box = browser_->run(
      "const b = document.getElementById('main-view').getBoundingClientRect();"
      "return [b.left + b.width / 2, b.top + b.height / 2]");
  const double x = box[0], y = box[1];
  browser_->touch("touchStart", {{x - 60, y}, {x + 60, y}});
  browser_->touch("touchMove", {{x - 90, y}, {x + 90, y}});
  browser_->touch("touchMove", {{x - 90, y + 40}, {x + 90, y + 40}});
  browser_->touch("touchEnd", {});
  EXPECT_TRUE(eventually([&] {
    return requested([](const ViewRequest& r) { return r.view == View::kMain && r.zoom < 0.9; }) &&
           requested([](const ViewRequest& r) { return r.view == View::kMain && r.elevation_rad > 0.05; });
  }));
}

TEST_F(PageForEveryone, EveryTextHasTheContrastOfWcagAA) {
  serve_in("en");
  for (const std::string drawer : {"system", "history", "keys", "settings"}) {
    browser_->run("openDrawer('" + drawer + "')");
    EXPECT_EQ(problems("weakContrasts()"), nlohmann::json::array()) << drawer;
  }
  browser_->run("document.getElementById('reset').click(); document.getElementById('law').focus()");
  browser_->type({Browser::kDown});
  stop_without_answer();
  EXPECT_EQ(problems("weakContrasts()"), nlohmann::json::array())
      << "with a stop, a question and an open choice";
}

#ifdef PHANTOM_AXE
TEST_F(PageForEveryone, AxeFindsNothing) {
  serve_in("en");
  std::ifstream file(PHANTOM_AXE);
  const std::string axe{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  ASSERT_FALSE(axe.empty()) << PHANTOM_AXE;
  browser_->run(axe);
  const auto findings = [&] {
    browser_->run(
        "window.found = null; axe.run(document, { resultTypes: ['violations'] }).then(result => { window.found ="
        "  result.violations.flatMap(v => v.nodes.map(n => v.id + ': ' + n.html)); }, problem => { window.found = [String(problem)]; });");
    EXPECT_TRUE(eventually([&] { return truth("window.found"); }));
    return browser_->run("return window.found");
  };
  for (const std::string drawer : {"settings", "system", "history", "keys"}) {
    browser_->run("openDrawer('" + drawer + "')");
    EXPECT_EQ(findings(), nlohmann::json::array()) << drawer;
  }
  browser_->run("speak('de')");
  browser_->show_on(768, 1024, true);
  stop_without_answer();
  EXPECT_EQ(findings(), nlohmann::json::array()) << "upright, with a stop that is not confirmed";
  browser_->run(
      "const image = document.createElement('img'); image.src = 'x'; document.getElementById('desk').append(image)");
  EXPECT_NE(findings(), nlohmann::json::array()) << "it finds what has no name";
}
#endif

TEST_F(PageForEveryone, ColoursThatMeanSomethingDifferForEveryColourVision) {
  serve_in("en");
  for (const auto& group : {std::vector{"good", "ready", "warn", "bad"}, std::vector{"near", "warn", "bad"},
                            std::vector{"percept", "feedback"}}) {
    std::vector<test::LinearColour> colours;
    for (const char* name : group)
      colours.push_back(problems("linearColour('--" + std::string(name) + "')").get<test::LinearColour>());
    for (std::size_t a = 0; a < group.size(); ++a) {
      for (std::size_t b = a + 1; b < group.size(); ++b)
        EXPECT_GE(test::least_difference(colours[a], colours[b]), 25) << group[a] << " and " << group[b];
    }
  }
}

}  // namespace
}  // namespace phantom::synthetic_viewer
