// A scripted operator who does the ten commonest things on the page by keyboard alone: no mouse, no script.
// How many keys each takes is counted, as a person would count them.
#include <gmock/gmock.h>

#include <functional>
#include <iostream>

#include "components/synthetic_viewer/tests/page_in_chromium.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;

constexpr int kMaxTabs = 120;

class KeyboardOperator : public test::PageInChromium {
 protected:
  void begin() {
    browser_arguments_ = {"--accept-lang=en"};
    gripper_ = true;
    serve(true);
    ASSERT_TRUE(
        eventually([&] { return truth("state && state.link.slave === 'COUPLED' && state.gripper"); }));
    ASSERT_TRUE(eventually([&] { return truth("document.querySelectorAll('#alarms li').length === 1"); }));
  }
  void press(const std::vector<std::string>& keys) {
    browser_->type(keys);
    keys_ += keys.size();
  }
  /// Presses Tab until the focus is at `id`, as seen by its mark.
  void tab_to(const std::string& id) {
    for (int i = 0; i < kMaxTabs; ++i) {
      if (truth("document.activeElement.id === '" + id + "'")) return;
      press({Browser::kTab});
    }
    FAIL() << id << " is not reached by Tab";
  }
  /// Does one thing and looks whether it is done. `most`: keys that it may take.
  void does(const std::string& what, std::size_t most, const std::function<void()>& act,
            const std::function<bool()>& done) {
    keys_ = 0;
    act();
    EXPECT_TRUE(eventually(done)) << what;
    EXPECT_LE(keys_, most) << what;
    std::cout << "by keyboard: " << what << ": " << keys_ << " keys\n";
  }
  double wide(const std::string& view) {
    return browser_
        ->run("return document.getElementById('" + view + "-figure').getBoundingClientRect().width")
        .get<double>();
  }

  std::size_t keys_ = 0;
};

TEST_F(KeyboardOperator, DoesTheTenCommonestThings) {
  begin();
  does(
      "ends the offer of a tour", 12,
      [&] {
        tab_to("tour-end");
        press({Browser::kEnter});
      },
      [&] { return truth("document.getElementById('tour').hidden"); });
  does(
      "acknowledges the alarm", 1, [&] { press({"q"}); },
      [&] { return truth("document.querySelector('#alarms .acknowledge').disabled"); });
  does(
      "turns and zooms the main view", 16,
      [&] {
        tab_to("main-view");
        press({Browser::kLeft, Browser::kLeft, "+"});
      },
      [&] {
        return requested([](const ViewRequest& r) { return r.view == View::kMain && r.azimuth_rad != 0; }) &&
               requested([](const ViewRequest& r) { return r.view == View::kMain && r.zoom < 1; });
      });
  does(
      "brings it back", 1, [&] { press({Browser::kHome}); },
      [&] { return requested([](const ViewRequest& r) { return r.view == View::kMain && r.home; }); });
  does(
      "shows the hit zone large, and the cell again", 10,
      [&] {
        tab_to("hit-view");
        press({"x"});
        EXPECT_TRUE(eventually([&] { return wide("hit") > 2 * wide("main"); }));
        press({"x"});
      },
      [&] { return wide("main") > 2 * wide("hit"); });
  does(
      "looks at the hit zone from above, and holds it", 2,
      [&] {
        press({"t", "h"});
      },
      [&] { return commanded(CommandKind::kViewNode, 13) && commanded(CommandKind::kViewHold, 1); });
  does(
      "switches the tone off", 1, [&] { press({"m"}); },
      [&] { return commanded(CommandKind::kSetPercepts, 5); });
  does(
      "closes the gripper", 30,
      [&] {
        tab_to("gripper-close");
        press({Browser::kEnter});
      },
      [&] { return commanded(CommandKind::kGripperWidth, 0); });
  does(
      "sets the percept's gain", 10,
      [&] {
        press({"o"});
        tab_to("gain");
        press({"2", ".", "5", Browser::kEnter});
      },
      [&] { return commanded(CommandKind::kSetPerceptGain, 2.5); });
  does(
      "stops", 1, [&] { press({Browser::kEscape}); },
      [&] { return commanded(CommandKind::kEmergencyStop, 0); });
  inbox_.stops.take_request(teleop::CommandAnswers(true, true, core::monotonic_ns()));
  ASSERT_TRUE(eventually([&] { return truth("!document.getElementById('stop-board').hidden"); }));
  does(
      "resets", 20,
      [&] {
        tab_to("reset");
        press({Browser::kEnter});
        EXPECT_TRUE(truth("document.activeElement.id === 'reset-no'")) << "nothing moves by one key too many";
        tab_to("reset-yes");
        press({Browser::kEnter});
      },
      [&] { return commanded(CommandKind::kReset, 0); });
}

}  // namespace
}  // namespace phantom::synthetic_viewer
