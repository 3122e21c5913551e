// The survey's page in a real Chromium: a person steers a simulated head by buttons, keys and clicks.
#include <nlohmann/json.hpp>
#include <thread>

#include "components/workspace_survey/page/candidates_page.hpp"
#include "components/workspace_survey/page/survey_page.hpp"
#include "components/workspace_survey/tests/assist_rig.hpp"
#include "components/workspace_survey/tests/page_client.hpp"

// After Eigen: it brings macros of the resolver that Eigen's names do not bear.
#include "components/synthetic_viewer/tests/web_driver.hpp"

namespace phantom::workspace_survey {
namespace {

using nlohmann::json;
using synthetic_viewer::test::Browser;
using testing::HasSubstr;

class SurveyInChromium : public AssistHead {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    mount(2);
    page_.emplace(0, terminal_);
    setup_ = setup();
    setup_.on_prompt = [this](const AssistView& view) { page_->show(view); };
    setup_.show = [this](const SurveyReport& report) {
      page_->show_candidates(candidates_page(report, "", {}));
      return std::string("  to pick one, see below the dialogue\n");
    };
    assistant_ = std::thread(
        [this] { exit_code_ = assist(config_, shipped_library(), setup_, page_->lines(), page_->words()); });
    browser_.emplace();
    browser_->open(page_->url());
  }
  void TearDown() override {
    if (!assistant_.joinable()) return;
    browser_.reset();
    PageClient client(page_->url());
    EXPECT_TRUE(client.wait_until_ready());
    EXPECT_EQ(client.send("quit"), 200);
    assistant_.join();
  }
  json js(const std::string& script) { return browser_->run(script); }
  bool wait_until(const std::string& condition) {
    for (int i = 0; i < 400; ++i) {
      if (js("return " + condition).get<bool>()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }
  /// Does what a person does, and waits until the assistant has answered.
  bool answered(const std::function<void()>& act) {
    const int before = js("return state.number");
    act();
    return wait_until("state.number > " + std::to_string(before) + " && !state.busy");
  }
  bool clicked(const std::string& selector) {
    return answered([&] { browser_->click(selector); });
  }
  bool typed(const std::string& line) {
    return answered([&] {
      js("document.querySelector('#type input').value = " + json(line).dump());
      browser_->click("#type button");
    });
  }
  double pan_deg() { return js("return state.pointing.pan_deg"); }
  double tilt_deg() { return js("return state.pointing.tilt_deg"); }

  std::ostringstream terminal_;
  std::optional<SurveyPage> page_;
  AssistSetup setup_;
  std::thread assistant_;
  std::optional<Browser> browser_;
};

TEST_F(SurveyInChromium, ButtonsKeysAndClicksSteerTheHead) {
  ASSERT_TRUE(wait_until("!state.busy"));
  EXPECT_THAT(js("return document.getElementById('pointing').textContent").get<std::string>(),
              HasSubstr("not aimed yet"));
  js("document.querySelector('#aim [name=pan]').value = '-1.5'; document.querySelector('#aim [name=tilt]').value = '45'");
  ASSERT_TRUE(clicked("#aim button"));
  EXPECT_NEAR(pan_deg(), -1.5, 0.02);
  EXPECT_NEAR(tilt_deg(), 45.0, 0.02);
  ASSERT_TRUE(clicked("[data-jog='1 0']"));
  EXPECT_NEAR(pan_deg(), -1.4, 0.02) << "to the left is more pan";
  js("document.querySelector('input[name=step][value=\"1\"]').click(); document.getElementById('map').focus()");
  ASSERT_TRUE(answered([&] {
    js("document.getElementById('map').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowUp', bubbles: true}))");
  }));
  EXPECT_NEAR(tilt_deg(), 46.0, 0.02) << "up is more tilt";
  // A click aims at the direction that the map has there.
  const json at =
      js("const c = document.getElementById('map'), b = c.getBoundingClientRect(); "
         "return toHead(0.3 * c.width, 0.4 * c.height, c)");
  ASSERT_TRUE(answered([&] {
    js("const c = document.getElementById('map'), b = c.getBoundingClientRect(); c.dispatchEvent(new MouseEvent("
       "'click', {clientX: b.left + 0.3 * b.width, clientY: b.top + 0.4 * b.height, bubbles: true}))");
  }));
  EXPECT_NEAR(pan_deg(), at.at("pan_deg").get<double>(), 0.02);
  EXPECT_NEAR(tilt_deg(), at.at("tilt_deg").get<double>(), 0.02);
  // What cannot be done is said.
  ASSERT_TRUE(typed("aim 300 0"));
  EXPECT_THAT(js("return document.getElementById('words').textContent").get<std::string>(),
              HasSubstr("does not reach pan 300.000 deg"));
}

TEST_F(SurveyInChromium, AFaceIsMeasuredAndOneOfSeveralPosesIsPicked) {
  ASSERT_TRUE(wait_until("!state.busy"));
  std::map<std::uint32_t, std::size_t> names;
  std::istringstream lines(person().face_lines(faces().front(), names));
  for (std::string line; std::getline(lines, line);)
    ASSERT_TRUE(line == "measure" || line == "done" || line == "part" ? clicked("[data-line='" + line + "']")
                                                                      : typed(line));
  EXPECT_EQ(js("return state.nodes.length").get<std::size_t>(), names.size());
  EXPECT_GT(js("return state.edges.length").get<int>(), 5) << "of the part that agrees best";
  const bool several = js("return state.candidates > 0");
  if (!several) {
    EXPECT_TRUE(js("return state.fitted").get<bool>());
    return;
  }
  ASSERT_TRUE(js("return document.getElementById('choice').getClientRects().length > 0").get<bool>());
  EXPECT_FALSE(js("return state.fitted").get<bool>());
  ASSERT_TRUE(answered([&] {
    browser_->enter_frame("#candidates");
    browser_->click(".card:nth-child(1) button");
    browser_->leave_frame();
  }));
  EXPECT_THAT(js("return document.getElementById('words').textContent").get<std::string>(),
              HasSubstr("pick 1"));
}

}  // namespace
}  // namespace phantom::workspace_survey
