// A page from elsewhere in the same, real Chromium as the operator's page: on another host name, on another
// port of this host, and under a name that is rebound to this host. It reads nothing and nothing of what it
// asks for is carried out.
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"
#include "components/synthetic_viewer/tests/web_driver.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using phantom::test::eventually;
using test::Browser;

constexpr const char* kSecret = "operate-operate-1";

/// Tries all that a page may try. When everything has been tried, window.tried tells how each ended.
constexpr const char* kAttack = R"js(
const [page, streams] = arguments_;
const stop = '{"kind":"emergency_stop"}', tries = {};
const within = (promise) => Promise.race([promise, new Promise(done => setTimeout(() => done('silence'), 5000))]);
const read = (url, options) => fetch(url, { credentials: 'include', ...options })
  .then(async answer => answer.type === 'opaque' ? 'opaque' : answer.ok ? 'READ ' + (await answer.text()).slice(0, 40) : 'refused')
  .catch(() => 'refused');
const loaded = (element, url) => new Promise(done => {
  element.onload = () => done(element.naturalWidth > 0 ? 'SHOWN' : 'refused');
  element.onerror = () => done('refused');
  element.src = url;
});
for (const path of ['/stop', '/state', '/session', '/snapshot/main.png', '/hits/1.jpg', '/page.js']) {
  tries['fetch ' + path] = read(page + path);
  tries['fetch without CORS ' + path] = read(page + path, { mode: 'no-cors' });
}
tries['fetch scene'] = read(streams + '/scene');
const post = (into, path, body) => {
  for (const type of ['application/json', 'text/plain', 'application/x-www-form-urlencoded'])
    for (const mode of ['cors', 'no-cors'])
      into[`post ${path} ${type} ${mode}`] = read(page + path, { method: 'POST', mode, headers: { 'Content-Type': type }, body });
};
post(tries, '/command', stop);
post(tries, '/view', '{"view":"main","zoom":2}');
tries.beacon = (navigator.sendBeacon(page + '/command', new Blob([stop], { type: 'text/plain' })), 'sent');
tries.request = new Promise(done => {
  const request = new XMLHttpRequest();
  request.onload = () => done(request.status === 200 ? 'READ' : 'refused');
  request.onerror = () => done('refused');
  request.open('POST', page + '/command');
  request.setRequestHeader('Content-Type', 'application/json');
  request.send(stop);
});
const frame = document.body.appendChild(document.createElement('iframe'));
frame.name = 'target';
const form = document.body.appendChild(document.createElement('form'));
Object.assign(form, { method: 'POST', action: page + '/command', enctype: 'text/plain', target: 'target' });
form.innerHTML = `<input name='{"kind":"emergency_stop","value":"' value='0"}'>`;
form.submit();
tries.picture = loaded(new Image(), page + '/snapshot/main.png');
tries.stream = loaded(new Image(), streams + '/stream/main');
tries['stream with CORS'] = loaded(Object.assign(new Image(), { crossOrigin: 'use-credentials' }), streams + '/stream/main');
tries.script = loaded(document.head.appendChild(document.createElement('script')), page + '/stop');
tries.numbers = new Promise(done => {
  const socket = new WebSocket(streams.replace('http', 'ws') + '/scene');
  socket.onmessage = ({ data }) => { if (typeof data === 'string') { socket.close(); done('READ ' + data); } };
  socket.onerror = () => { socket.close(); done('refused'); };
});
tries.socket = new Promise(done => {
  const socket = new WebSocket(page.replace('http', 'ws') + '/scene');
  socket.onopen = () => done('OPEN');
  socket.onerror = () => done('refused');
});
const embedded = document.body.appendChild(document.createElement('iframe'));
tries.frame = new Promise(done => {
  const look = () => { try { done(embedded.contentDocument?.getElementById('stop') ? 'READ' : 'refused'); } catch (problem) { done('refused'); } };
  embedded.onload = look;
  embedded.src = page + '/';
});
window.tried = null;
const ended = (some) => Promise.all(Object.entries(some).map(async ([name, outcome]) => [name, await within(outcome)]));
ended(tries).then(async all => {
  const logins = {};  // last: a new session ends the one that the other requests have
  post(logins, '/login', '{"secret":"operate-operate-1"}');
  window.tried = Object.fromEntries([...all, ...await ended(logins)]);
});
)js";

class HostilePage : public test::Page {
 protected:
  void SetUp() override {
    if (!Browser::installed())
      GTEST_SKIP() << "chromium and chromium-driver are not installed (scripts/setup)";
    evil_.Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_content("<!DOCTYPE html><title>Kittens</title><body></body>", "text/html");
    });
    // So that the viewer can have the port afterwards.
    evil_.set_socket_options([](int descriptor) {
      const int yes = 1;
      setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    evil_port_ = evil_.bind_to_any_port("127.0.0.1");
    evil_thread_ = std::thread([this] { evil_.listen_after_bind(); });
    ASSERT_TRUE(eventually([&] { return evil_.is_running(); }));
    std::vector<unsigned char> jpeg;
    cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)), jpeg);
    jpeg_.assign(jpeg.begin(), jpeg.end());
    content_.main_png = [this] { return ++given_, jpeg_; };
    content_.hit_picture = [this](std::uint32_t) { return ++given_, jpeg_; };
    content_.stops = [this] { return ++given_, StopView(); };
    content_.view(View::kMain).jpeg.publish(jpeg_);
    content_.state.publish(nlohmann::json{{"secret state", 1}});
    feed_ = std::make_unique<SceneFeed>(config_, config_.page.scene_Hz, "cell", inbox_, content_);
    feed_->start();
    scene_ = feed_.get();
  }
  void TearDown() override {
    browser_.reset();
    end_evil();
    server_.reset();
  }
  void end_evil() {
    evil_.stop();
    if (evil_thread_.joinable()) evil_thread_.join();
  }
  void start_browser() {
    browser_ = std::make_unique<Browser>(
        std::vector<std::string>{"--host-resolver-rules=MAP evil.example 127.0.0.1"});
  }
  /// Waits until no window follows anything.
  bool unfollowed() {
    return eventually(
        [&] { return content_.view(View::kMain).jpeg.followers == 0 && content_.state.followers == 0; });
  }
  /// Runs the attack in the page that is open. `page`, `streams`: where it finds the operator's page.
  nlohmann::json attacked(const std::string& page, const std::string& streams) {
    browser_->run("window.tried = null; (function (...arguments_) {" + std::string(kAttack) + "})('" + page +
                  "', '" + streams + "')");
    nlohmann::json tried;
    EXPECT_TRUE(eventually([&] { return !(tried = browser_->run("return window.tried")).is_null(); }));
    return tried;
  }
  std::size_t carried_out() {
    const std::lock_guard lock(mutex_);
    return commands_.size() + requests_.size();
  }
  static bool got_something(const nlohmann::json& outcome) {
    const auto text = outcome.get<std::string>();
    return text.starts_with("READ") || text == "SHOWN" || text == "OPEN";
  }
  /// Nothing was read, shown or carried out.
  void expect_nothing(const nlohmann::json& tried, const std::string& from) {
    EXPECT_GE(tried.size(), 30U);
    for (const auto& [what, outcome] : tried.items())
      EXPECT_FALSE(got_something(outcome)) << from << ": " << what << ": " << outcome;
    EXPECT_EQ(given_, 0) << from;
    EXPECT_EQ(carried_out(), 0U) << from;
    EXPECT_EQ(content_.view(View::kMain).jpeg.followers, 0) << from;
    EXPECT_EQ(content_.state.followers, 0) << from;
  }
  std::string evil_at(const std::string& host) const {
    return "http://" + host + ":" + std::to_string(evil_port_) + "/";
  }
  std::string streams() const { return "http://127.0.0.1:" + std::to_string(server_->stream_port()); }

  httplib::Server evil_;
  int evil_port_ = 0;
  std::thread evil_thread_;
  std::string jpeg_;
  std::atomic<int> given_{0};
  ViewerConfig config_;
  Inbox inbox_;
  std::unique_ptr<SceneFeed> feed_;
  std::unique_ptr<Browser> browser_;
};

PageConfig with_operators_secret() {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", kSecret, "configure-config"});
  return config;
}

TEST_F(HostilePage, FromAnotherHostOrPortReadsAndCommandsNothingWhileTheOperatorsPageWorks) {
  serve(with_operators_secret());
  start_browser();
  const std::string page = "http://127.0.0.1:" + std::to_string(server_->port());
  browser_->open(page + "/");
  // Logged in: the browser has a cookie that it could send along.
  browser_->run("document.getElementById('secret').value = '" + std::string(kSecret) +
                "'; document.querySelector('#login button').click()");
  ASSERT_TRUE(eventually([&] { return browser_->run("return session.role") == "operate"; }));
  // What the attack looks for is there, for the page itself.
  const auto own = attacked(page, streams());
  EXPECT_TRUE(got_something(own.at("fetch /stop"))) << own;
  EXPECT_TRUE(got_something(own.at("picture")) && got_something(own.at("stream with CORS")) &&
              got_something(own.at("numbers")))
      << own;
  EXPECT_TRUE(got_something(own.at("post /command application/json cors")) &&
              got_something(own.at("request")))
      << own;
  EXPECT_GT(carried_out(), 0U);
  browser_->open("about:blank");
  ASSERT_TRUE(unfollowed());
  for (const char* host : {"evil.example", "localhost", "127.0.0.1"}) {
    browser_->open(evil_at(host));
    commands_.clear();
    requests_.clear();
    given_ = 0;
    expect_nothing(attacked(page, streams()), host);
  }
  // A window of the operator's page that it opens is the operator's: not to be looked into.
  for (const char* host : {"evil.example", "localhost", "127.0.0.1"}) {
    browser_->open(evil_at(host));
    browser_->run("window.opened = window.open('" + page + "/', 'opened')");
    const auto looked = [&] {
      return browser_->run("try { return opened.location.href; } catch (problem) { return 'refused'; }");
    };
    EXPECT_TRUE(eventually([&] { return looked() == "refused"; })) << host << ": " << looked();
    browser_->run("window.opened.close()");
  }
  browser_->open_window(page + "/");
  ASSERT_TRUE(eventually([&] { return browser_->run("return session.role") == "operate"; }));
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return carried_out() == 1; }));
}

// The hostile page's own server goes away, and its name and port lead to the viewer: for the browser both are
// one origin.
TEST_F(HostilePage, UnderAReboundNameReadsAndCommandsNothing) {
  start_browser();
  const std::string rebound = "http://evil.example:" + std::to_string(evil_port_);
  browser_->open(rebound + "/");
  EXPECT_EQ(browser_->run("return document.title"), "Kittens");
  end_evil();
  serve({}, evil_port_);  // without secrets: whoever is let in may command
  const std::string streams_rebound = "http://evil.example:" + std::to_string(server_->stream_port());
  expect_nothing(attacked(rebound, streams_rebound), "rebound");
  browser_->open_window("http://localhost:" + std::to_string(evil_port_) + "/");
  browser_->type({Browser::kEscape});
  EXPECT_TRUE(eventually([&] { return carried_out() == 1; }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
