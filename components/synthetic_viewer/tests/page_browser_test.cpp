// The operator's page in a real Chromium: live data, sessions, and how it finds its viewer. What its scripts
// make of state, keys and pointers is tested without a browser (web/tests).
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "common/web/tests/certificate.hpp"
#include "common/web/tls_context.hpp"
#include "components/synthetic_viewer/tests/page_in_chromium.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Browser;
using test::eventually;
using test::PageInChromium;

TEST_F(PageInChromium, ShowsViewsGaugesAlertsAndComponentsLive) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_EQ(text("voxel-error"), "4.3 mm");
  EXPECT_EQ(text("round-trip"), "2.10 ms");
  EXPECT_EQ(text("closeness"), "0.47");
  EXPECT_EQ(text("motion"), "dangerous");
  EXPECT_EQ(browser_->run("return document.querySelectorAll('#joints .joint').length"), 6);
  EXPECT_EQ(browser_->run("return document.querySelectorAll('#joints .joint .value')[1].textContent"),
            "-0.80");
  EXPECT_THAT(text("components"), testing::HasSubstr("slave_io"));
  EXPECT_THAT(text("components"), testing::HasSubstr("RUNNING"));
  for (const char* view : {"main-view", "hit-view", "tool-view"}) {
    EXPECT_TRUE(eventually([&] {
      return truth(std::string("document.getElementById('") + view + "').naturalWidth > 0");
    })) << view;
  }
  EXPECT_TRUE(eventually([&] { return truth("document.querySelector('#alarms img').naturalWidth > 0"); }))
      << "the alert's picture";
  EXPECT_TRUE(truth("document.querySelector('#alarms svg .place')")) << "and its place until that came";
  browser_->type({"j"});
  EXPECT_TRUE(eventually([&] { return truth("document.querySelector('#hits img').naturalWidth > 0"); }))
      << "and in the history";
  browser_->type({"j"});
  EXPECT_EQ(text("banner"), "");
  EXPECT_TRUE(eventually(
      [&] { return text("percepts") == "Torque feedback, balanced arm (b1): drag, tone and views"; }));
  browser_->run("speak('de')");
  EXPECT_EQ(text("percepts"), "Momentenrückführung, Arm im Gleichgewicht (b1): Kraft, Ton und Bild")
      << "what the viewer says by keys and values";
  browser_->run("speak('en')");
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS")) {
    std::ofstream(std::string(folder) + "/page.png", std::ios::binary) << browser_->screenshot();
  }
  EXPECT_EQ(
      browser_->run("document.querySelectorAll('body *').forEach(e => { e.hidden = true });"
                    "return [...document.querySelectorAll('body *')].filter(e => e.offsetParent).length"),
      0)
      << "what is hidden takes no room, whatever its style";
}

TEST_F(PageInChromium, StopsWithoutASessionAndShowsAndCommandsWithOne) {
  config_.page.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve(true);
  const auto log_in = [&](const std::string& secret) {
    ASSERT_TRUE(eventually([&] { return truth("document.getElementById('login').offsetParent"); }));
    browser_->run("document.getElementById('secret').value = '" + secret +
                  "'; document.querySelector('#login button').click()");
  };
  log_in("wrong-wrong-wrong-wrong");
  EXPECT_TRUE(eventually([&] { return text("login-answer").find("none of the page") != std::string::npos; }));
  EXPECT_EQ(text("slave-state"), "–");
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0); }));
  log_in("watch-watch-watch");
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('main-view').naturalWidth > 0"); }));
  EXPECT_EQ(text("role"), "Role: watch");
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('reset').disabled"); }));
  EXPECT_TRUE(truth("!document.getElementById('stop').disabled"));
  browser_->run("document.getElementById('logout').click()");
  log_in("operate-operate-1");
  EXPECT_TRUE(eventually([&] { return text("role") == "Role: operate"; }));
  EXPECT_TRUE(eventually([&] {
    return truth("!document.getElementById('reset').disabled && document.getElementById('law').disabled");
  }));
  if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS")) {
    std::ofstream(std::string(folder) + "/operate.png", std::ios::binary) << browser_->screenshot();
  }
}

// The session's cookie goes by TLS alone, and to the streams' port, too.
TEST_F(PageInChromium, ShowsAndCommandsByHttps) {
  const web::test::Certificate own;
  config_.page.tls = std::make_shared<web::TlsContext>(own.certificate, own.key);
  config_.page.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  browser_arguments_ = {"--ignore-certificate-errors"};  // it is signed by nobody that the browser knows
  serve(true);
  EXPECT_TRUE(server_->url().starts_with("https://"));
  ASSERT_TRUE(eventually([&] { return truth("document.getElementById('login').offsetParent"); }));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kEmergencyStop, 0); }));
  browser_->run(
      "document.getElementById('secret').value = 'operate-operate-1'; document.querySelector('#login button').click()");
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED"; }));
  EXPECT_TRUE(eventually([&] { return truth("document.getElementById('main-view').naturalWidth > 0"); }));
  EXPECT_TRUE(eventually([&] {
    return truth("stream.open && stream.state && stream.url.startsWith('wss:')");
  })) << "numbers come by their own port";
  browser_->type({"t"});
  EXPECT_TRUE(eventually([&] { return commanded(CommandKind::kViewNode, 13); }));
}

// A browser that does not draw the scene itself.
TEST_F(PageInChromium, NumbersAndAlertsComeByOneSocketAndNothingOfTheScene) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return truth("stream.open && stream.state && !stream.still"); }));
  ASSERT_TRUE(eventually([&] { return text("scene-source").find("no WebGL 2") != std::string::npos; }));
  browser_->run(
      "window.kinds = {}; const take = stream.take; stream.take = function (data) {"
      "  const kind = typeof data === 'string' ? JSON.parse(data).type : new Uint8Array(data)[0];"
      "  kinds[kind] = (kinds[kind] ?? 0) + 1; take.call(this, data); };");
  for (std::uint32_t number = 2; number <= 50; ++number) inbox_.put(alert(number, {0.71, 0.13, 1.03}));
  ASSERT_TRUE(eventually([&] { return text("hit-count") == "50"; }));
  EXPECT_EQ(browser_->run("return document.querySelectorAll('#alarms li').length"), 1)
      << "one threat, one alarm";
  browser_->type({"j"});
  ASSERT_TRUE(eventually([&] { return truth("document.querySelector('#hits li.none')"); }));
  const nlohmann::json listed = browser_->run(
      "return [...document.querySelectorAll('#hits li:not(.none) img')].map(e => +e.src.match(/(\\d+).jpg/)[1])");
  ASSERT_EQ(listed.size(), ViewerState::kMaxHits);
  for (std::size_t i = 0; i < listed.size(); ++i) EXPECT_EQ(listed[i], 50 - i) << "newest first, each once";
  EXPECT_EQ(browser_->run("return document.querySelector('#hits li.none').textContent"),
            "10 earlier alerts are not listed.");
  ASSERT_TRUE(eventually([&] { return truth("kinds.state >= 10 && kinds[3] >= 10"); }));
  EXPECT_TRUE(truth("Object.keys(kinds).every(kind => ['state', 'echo', '3'].includes(kind))"))
      << browser_->run("return kinds");
  EXPECT_EQ(content_.scene.followers, 0);
  EXPECT_EQ(content_.state.followers, 1);
  browser_->run("speak('de')");
  EXPECT_EQ(browser_->run("return document.querySelector('#hits li.none').textContent"),
            "10 frühere Alarme stehen nicht in der Liste.");
}

TEST_F(PageInChromium, FindsAViewerThatWasStartedAnewAlsoWhereItsStreamsHaveAnotherPort) {
  serve(true);
  ASSERT_TRUE(eventually([&] { return text("slave-state") == "COUPLED" && truth("stream.state"); }));
  config_.page.port = server_->port();
  const int before = server_->stream_port();
  browser_->run("window.before = true");
  server_.reset();
  feed_.reset();
  EXPECT_TRUE(eventually([&] { return text("banner").find("NO CONNECTION") != std::string::npos; }));
  begin_server();
  if (server_->stream_port() == before) GTEST_SKIP() << "the system gave the same port again";
  EXPECT_TRUE(eventually([&] {
    return truth("!window.before && document.readyState === 'complete' && stream.open && stream.state");
  }));
  // On the same port it is found without loading the page again.
  config_.page.stream_port = server_->stream_port();
  browser_->run("window.before = true");
  server_.reset();
  feed_.reset();
  EXPECT_TRUE(eventually([&] { return truth("!stream.open"); }));
  begin_server();
  EXPECT_TRUE(eventually([&] { return truth("window.before && stream.open && stream.state"); }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
