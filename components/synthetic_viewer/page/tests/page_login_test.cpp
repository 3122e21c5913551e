// Roles, sessions and wrong secrets at the page's server.
#include <atomic>
#include <thread>

#include "common/web/login_guard.hpp"
#include "components/synthetic_viewer/page/commands.hpp"
#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "components/synthetic_viewer/scene/pose_calibration.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;

TEST(Roles, TheStopNeedsNone) {
  using enum teleop::CommandKind;
  EXPECT_FALSE(role_for(kEmergencyStop));
  EXPECT_EQ(role_for(kReset), web::Role::kOperate);
  EXPECT_EQ(role_for(kSetPerceptGain), web::Role::kOperate);
  EXPECT_EQ(role_for(kSetLaw), web::Role::kConfigure);
  EXPECT_EQ(role_for(kSetFeedbackGain), web::Role::kConfigure);
}

class PageLogin : public test::Page {
 protected:
  /// `from`: the address of loopback that it comes from.
  httplib::Result log_in(const std::string& secret, const char* from = "127.0.0.1") const {
    httplib::Client one = client();
    one.set_interface(from);
    return one.Post("/login", R"({"secret":")" + secret + "\"}", "application/json");
  }
};

PageConfig with_secrets() {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  return config;
}

TEST_F(PageLogin, WithoutASessionThereIsThePageAndTheStopAndNothingElse) {
  serve(with_secrets());
  content_.main_png = [] { return std::string("PNG"); };
  content_.state.publish(nlohmann::json{{"t", 1}});
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  for (const char* path : {"/", "/page.js", "/page.css", "/stop.js", "/session.js", "/stop", "/session"})
    EXPECT_EQ(client().Get(path)->status, 200) << path;
  for (const char* path : {"/state", "/snapshot/main.png", "/hits/1.jpg", "/nowhere", "//stop", "/stop/"})
    EXPECT_EQ(client().Get(path)->status, 401) << path;
  for (const char* path : {"/scene", "/stream/main", "/stop", "/"})
    EXPECT_EQ(stream_client().Get(path)->status, 401) << path;
  EXPECT_EQ(post(R"({"kind":"reset"})").first, 401);
  EXPECT_EQ(post(R"({"view":"main","zoom":2})", {}, "application/json", "/view").first, 401);
  EXPECT_TRUE(commands_.empty());
  EXPECT_TRUE(requests_.empty());
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
  EXPECT_EQ(commands_.size(), 1U);
}

TEST_F(PageLogin, ASessionMayWhatItsRoleMay) {
  serve(with_secrets());
  content_.main_png = [] { return std::string("PNG"); };
  content_.state.publish(nlohmann::json{{"t", 1}});
  const auto log_in = [this](const std::string& secret, const httplib::Headers& headers = {}) {
    return client().Post("/login", headers, R"({"secret":")" + secret + "\"}", "application/json");
  };
  struct Case {
    const char* secret;
    const char* role;
    int view, reset, law;
  };
  for (const Case& one : {Case{"watch-watch-watch", "watch", 403, 403, 403},
                          Case{"operate-operate-1", "operate", 200, 200, 403},
                          Case{"configure-config", "configure", 200, 200, 200}}) {
    const auto opened = log_in(one.secret);
    ASSERT_EQ(opened->status, 200) << one.role;
    EXPECT_EQ(nlohmann::json::parse(opened->body).at("role"), one.role);
    const std::string cookie = opened->get_header_value("Set-Cookie");
    for (const char* part : {"HttpOnly", "SameSite=Strict", "Path=/", "Max-Age=43200"})
      EXPECT_THAT(cookie, HasSubstr(part));
    const httplib::Headers session{{"Cookie", "a=b; " + cookie.substr(0, cookie.find(';'))}};
    EXPECT_EQ(client().Get("/state", session)->status, 200);
    EXPECT_EQ(client().Get("/snapshot/main.png", session)->body, "PNG");
    EXPECT_EQ(nlohmann::json::parse(client().Get("/session", session)->body).at("role"), one.role);
    EXPECT_EQ(post(R"({"view":"main","zoom":2})", session, "application/json", "/view").first, one.view);
    EXPECT_EQ(post(R"({"kind":"reset"})", session).first, one.reset);
    EXPECT_EQ(post(R"({"object":"pump","attach":true})", session, "application/json", "/carry").first,
              one.reset);
    EXPECT_EQ(post(R"({"undo":"pump"})", session, "application/json", "/model").first, one.law);
    EXPECT_EQ(post(R"({"kind":"set_percepts","value":5})", session).first, one.reset);
    EXPECT_EQ(post(R"({"kind":"counterbalance","value":1})", session).first, one.law);
    const auto [law, message] = post(R"({"kind":"set_law","value":1})", session);
    EXPECT_EQ(law, one.law);
    EXPECT_EQ(message.find("needs the role configure") != std::string::npos, law == 403);
    EXPECT_EQ(post(R"({"kind":"emergency_stop"})", session).first, 200);
    EXPECT_EQ(client().Post("/logout", session, "{}", "application/json")->status, 200);
    EXPECT_EQ(client().Get("/state", session)->status, 401);
  }
  EXPECT_EQ(log_in("wrong-wrong-wrong-wrong")->status, 401);
  EXPECT_FALSE(log_in("wrong-wrong-wrong-wrong")->has_header("Set-Cookie"));
  EXPECT_EQ(log_in("configure-config", {{"Origin", "http://elsewhere.example"}})->status, 403);
  EXPECT_EQ(client().Post("/login", R"({"secret":7})", "application/json")->status, 400);
  EXPECT_EQ(client().Get("/state", {{"Cookie", "phantom_" + std::to_string(server_->port()) + "="}})->status,
            401);
}

TEST_F(PageLogin, WhereACameraStandsIsSetByWhoMayCommand) {
  VideoCamera camera;
  camera.name = "gate";
  camera.calibration.lens = camera::Lens{640, 480, 520, 520, 320, 240};
  camera.calibration.X_WC = geometry::Pose();
  PoseCalibration poses(camera, 640, 480);
  content_.calibration = &poses;
  serve(with_secrets());
  const auto discard = [&](const httplib::Headers& headers) {
    return post(R"({"discard": 1})", headers, "application/json", "/calibration");
  };
  for (const char* path : {"/calibration", "/calibration/still.jpg", "/calibration/overlay.jpg"})
    EXPECT_EQ(client().Get(path)->status, 401) << path;
  EXPECT_EQ(discard({}).first, 401);
  for (const auto& [secret, status, words] : {std::tuple{"watch-watch-watch", 403, "needs the role operate"},
                                              {"operate-operate-1", 400, "no pose is on trial"}}) {
    const auto opened = log_in(secret);
    const std::string cookie = opened->get_header_value("Set-Cookie");
    httplib::Headers session{{"Cookie", cookie.substr(0, cookie.find(';'))}};
    EXPECT_EQ(client().Get("/calibration", session)->status, 200);
    EXPECT_THAT(client().Get("/calibration/still.jpg", session)->body, HasSubstr("gate gives no picture"));
    EXPECT_EQ(client().Get("/calibration/overlay.jpg", session)->status, 503);
    const auto answer = discard(session);
    EXPECT_EQ(answer.first, status);
    EXPECT_THAT(answer.second, HasSubstr(words));
    session.emplace("Origin", "http://elsewhere.example");
    EXPECT_EQ(discard(session).first, 403);
  }
  PageConfig shows_only;
  shows_only.allow_commands = false;
  serve(shows_only);
  EXPECT_THAT(discard({}).second, HasSubstr("this viewer only shows"));
}

// The watcher's stream is not longer than the session.
TEST_F(PageLogin, AStreamEndsWithItsSession) {
  serve(with_secrets());
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  const auto opened = client().Post("/login", R"({"secret":"watch-watch-watch"})", "application/json");
  const std::string cookie = opened->get_header_value("Set-Cookie");
  const httplib::Headers session{{"Cookie", cookie.substr(0, cookie.find(';'))}};
  std::atomic<bool> begun{false};
  std::thread follower([&] {
    stream_client().Get("/stream/main", session, [&](const char*, std::size_t) { return begun = true; });
  });
  for (int k = 0; k < 1000 && !begun; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(begun);
  client().Post("/logout", session, "{}", "application/json");
  follower.join();  // the server ends it
  EXPECT_EQ(content_.view(View::kMain).jpeg.followers, 0);
}

TEST_F(PageLogin, WithoutSecretsNobodyLogsInAndThePageSaysSo) {
  serve();
  EXPECT_EQ(client().Post("/login", R"({"secret":"x"})", "application/json")->status, 409);
  EXPECT_EQ(nlohmann::json::parse(client().Get("/session")->body).at("secrets"), false);
}

TEST_F(PageLogin, WhoGuessesIsSlowedAndOthersGetIn) {
  serve(with_secrets());
  for (int i = 0; i < web::LoginLimits().tries; ++i)
    EXPECT_EQ(log_in("wrong-wrong-wrong", "127.0.0.2")->status, 401);
  for (const char* secret : {"wrong-wrong-wrong", "operate-operate-1"}) {
    const auto refused = log_in(secret, "127.0.0.2");
    EXPECT_EQ(refused->status, 429) << "without having been looked at";
    EXPECT_FALSE(refused->has_header("Set-Cookie"));
    EXPECT_THAT(refused->get_header_value("Retry-After"), ::testing::MatchesRegex("[1-9]|10"));
    EXPECT_THAT(refused->body, HasSubstr("too many wrong secrets"));
  }
  for (int i = 0; i < 3 * web::LoginLimits().tries; ++i)
    EXPECT_EQ(log_in("operate-operate-1", "127.0.0.3")->status, 200) << "right ones are not counted";
  EXPECT_EQ(client().Post("/login", R"({"secret":7})", "application/json")->status, 400);
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
