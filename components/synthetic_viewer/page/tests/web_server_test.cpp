#include "components/synthetic_viewer/page/web_server.hpp"

#include <numbers>
#include <thread>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/page/tests/page_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::Page;
using ::testing::HasSubstr;

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++found;
  return found;
}

TEST_F(Page, IsServedWithItsFilesAndNothingFromElsewhere) {
  serve();
  const auto page = client().Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->get_header_value("Content-Type"), HasSubstr("text/html"));
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"), HasSubstr("default-src 'self'"));
  EXPECT_THAT(page->body, HasSubstr("Emergency stop"));
  for (const char* file : {"/page.css", "/page.js", "/stop.js", "/session.js"}) {
    const auto result = client().Get(file);
    ASSERT_TRUE(result) << file;
    EXPECT_EQ(result->status, 200);
    EXPECT_GT(result->body.size(), 1000U);
    EXPECT_EQ(result->body.find("http://"), std::string::npos) << file;
    EXPECT_EQ(result->body.find("https://"), std::string::npos) << file;
  }
}

TEST_F(Page, AnUnknownPathIsNotFoundAndSaysSo) {
  serve();
  const auto result = client().Get("/../etc/passwd");
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, 404);
  EXPECT_THAT(result->body, HasSubstr("unknown path"));
}

TEST_F(Page, StreamsPicturesAsTheyCome) {
  serve();
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 first"));
  std::thread painter([this] {
    for (int k = 0; k < 200 && content_.view(View::kMain).jpeg.followers == 0; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 second"));
  });
  const std::string got = follow(
      "/stream/main", [](const std::string& text) { return text.find("second") != std::string::npos; });
  painter.join();
  EXPECT_THAT(got, HasSubstr("--picture\r\nContent-Type: image/jpeg\r\nContent-Length: "));
  EXPECT_THAT(got, HasSubstr("\xFF\xD8 second"));
}

TEST_F(Page, AStillPictureIsRepeatedSoThatADeadConnectionShows) {
  serve();
  content_.view(View::kHit).jpeg.publish(std::string("\xFF\xD8 still"));
  const std::string got =
      follow("/stream/hit", [](const std::string& text) { return count(text, "still") >= 2; });
  EXPECT_GE(count(got, "still"), 2);
}

// Tries synthetic_viewer: all streams taken
TEST_F(Page, MoreFollowersThanAllowedAreTurnedAwayAndCommandsStillPass) {
  PageConfig config;
  config.max_streams = 2;
  serve(config);
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  std::atomic<bool> enough{false};
  std::vector<std::thread> followers;
  for (int i = 0; i < 2; ++i) {
    followers.emplace_back(
        [&] { follow("/stream/main", [&](const std::string&) { return enough.load(); }); });
  }
  for (int k = 0; k < 500 && content_.view(View::kMain).jpeg.followers < 2; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const auto result = stream_client().Get("/stream/hit");
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, 503);
  EXPECT_THAT(result->body, HasSubstr("page.max_streams"));
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
  enough = true;
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 last"));
  for (auto& follower : followers) follower.join();
}

TEST_F(Page, GivesPicturesOfTheMainViewAndOfAlerts) {
  serve();
  EXPECT_EQ(client().Get("/snapshot/main.png")->status, 503);
  content_.main_png = [] { return std::string("PNG"); };
  content_.hit_picture = [](std::uint32_t alert) {
    return alert == 12 ? std::string("JPEG") : std::string();
  };
  EXPECT_EQ(client().Get("/snapshot/main.png")->body, "PNG");
  EXPECT_EQ(client().Get("/hits/12.jpg")->body, "JPEG");
  EXPECT_EQ(client().Get("/hits/13.jpg")->status, 404);
  EXPECT_EQ(client().Get("/hits/99999999999999.jpg")->status, 404);
}

TEST_F(Page, PassesSoundCommandsOn) {
  serve();
  EXPECT_EQ(post(R"({"kind":"set_percept_gain","value":2.5})").first, 200);
  EXPECT_EQ(post(R"({"kind":"view_node","value":14})").first, 200);
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
  ASSERT_EQ(commands_.size(), 3U);
  EXPECT_EQ(commands_[0].kind, CommandKind::kSetPerceptGain);
  EXPECT_EQ(commands_[0].value, 2.5);
  EXPECT_EQ(commands_[2].kind, CommandKind::kEmergencyStop);
}

TEST_F(Page, RefusesCommandsOutOfRangeAndSaysWhatIsAllowed) {
  serve();
  const std::vector<std::pair<const char*, const char*>> cases{
      {R"({"kind":"set_percept_gain","value":-1})", "allowed: 0 to 1000"},
      {R"({"kind":"set_percept_gain","value":1001})", "allowed: 0 to 1000"},
      {R"({"kind":"set_percept_gain","value":"much"})", "must be a number"},
      {R"({"kind":"set_percept_gain"})", "must be a number"},
      {R"({"kind":"set_feedback_gain","value":11})", "allowed: 0 to 10"},
      {R"({"kind":"enable_percept","value":0.5})", "a whole number from 0 to 1"},
      {R"({"kind":"view_node","value":15})", "from 0 to 14"},
      {R"({"kind":"set_law","value":5})", "from 0 to 4"},
      {R"({"kind":"fly"})", "emergency_stop"},
      {R"({"kind":7})", "must be one of"},
      {R"({"kind":"reset","now":true})", "unknown key 'now'"},
      {R"([1,2])", "JSON object"},
      {"{", "JSON object"}};
  for (const auto& [body, part] : cases) {
    const auto [status, message] = post(body);
    EXPECT_EQ(status, 400) << body;
    EXPECT_THAT(message, HasSubstr(part)) << body;
  }
  EXPECT_TRUE(commands_.empty());
}

TEST_F(Page, RefusesEveryCommandWhereTheyAreSwitchedOff) {
  PageConfig config;
  config.allow_commands = false;
  serve(config);
  const auto [status, message] = post(R"({"kind":"emergency_stop"})");
  EXPECT_EQ(status, 403);
  EXPECT_THAT(message, HasSubstr("page.allow_commands"));
  EXPECT_TRUE(commands_.empty());
}

TEST_F(Page, RefusesCommandsThatAreNotThePagesOwn) {
  serve();
  const std::string stop = R"({"kind":"emergency_stop"})";
  EXPECT_EQ(post(stop, {}, "text/plain").first, 403);
  EXPECT_EQ(post(stop, {{"Origin", "http://elsewhere.example"}}).first, 403);
  EXPECT_EQ(post(stop, {{"Sec-Fetch-Site", "cross-site"}}).first, 403);
  EXPECT_EQ(post(stop, {{"Host", "elsewhere.example"}, {"Origin", "http://elsewhere.example"}}).first, 403);
  EXPECT_TRUE(commands_.empty());
  const std::string own = "127.0.0.1:" + std::to_string(server_->port());
  EXPECT_EQ(post(stop, {{"Host", own}, {"Origin", "http://" + own}}).first, 200);
}

// A hostile page reaches this port under a name of its own that resolves to this host. It neither commands
// nor reads.
TEST_F(Page, AReboundNameReachesNothing) {
  serve();
  content_.main_png = [] { return std::string("PNG"); };
  content_.state.publish(nlohmann::json{{"t", 1}});
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  const std::string port = ":" + std::to_string(server_->port());
  for (const std::string name : {"127.attacker.example", "127.0.0.1.evil", "localhost.evil", "2130706433"}) {
    const httplib::Headers rebound{{"Host", name + port}, {"Origin", "http://" + name + port}};
    EXPECT_EQ(post(R"({"kind":"set_percept_gain","value":10})", rebound).first, 403) << name;
    EXPECT_EQ(post(R"({"view":"main","zoom":2})", rebound, "application/json", "/view").first, 403) << name;
    for (const char* path : {"/", "/page.js", "/stop", "/state", "/snapshot/main.png", "/hits/1.jpg"})
      EXPECT_EQ(client().Get(path, {{"Host", name + port}})->status, 403) << name << path;
    for (const char* path : {"/scene", "/stream/main"})
      EXPECT_EQ(stream_client().Get(path, {{"Host", name}})->status, 403) << name << path;
  }
  EXPECT_EQ(client().Get("/stop", {{"Host", "localhost"}, {"Host", "localhost"}})->status, 400);
  EXPECT_EQ(client().Get("/stop", {{"Host", "localhost" + port}})->status, 200);
  EXPECT_TRUE(commands_.empty());
  EXPECT_TRUE(requests_.empty());
}

TEST_F(Page, AConfiguredNameIsServed) {
  PageConfig config;
  config.host_names = {"viewer.example"};
  serve(config);
  EXPECT_EQ(client().Get("/stop", {{"Host", "viewer.example:8080"}})->status, 200);
  EXPECT_EQ(post(R"({"kind":"emergency_stop"})", {{"Host", "viewer.example"}}).first, 200);
}

TEST_F(Page, PassesSoundViewRequestsOn) {
  serve();
  const auto view = [this](const char* body) { return post(body, {}, "application/json", "/view").first; };
  EXPECT_EQ(view(R"({"view":"hit","orbit_deg":[90,-45],"zoom":0.5})"), 200);
  EXPECT_EQ(view(R"({"view":"tool","home":true})"), 200);
  EXPECT_EQ(view(R"({"view":"main","record":true})"), 200);
  EXPECT_EQ(view(R"({"view":"hit","approach":false})"), 200);
  ASSERT_EQ(requests_.size(), 4U);
  EXPECT_FALSE(requests_[0].approach.has_value());
  EXPECT_EQ(requests_[3].approach, false);
  EXPECT_EQ(requests_[0].view, View::kHit);
  EXPECT_NEAR(requests_[0].azimuth_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(requests_[0].elevation_rad, -std::numbers::pi / 4, 1e-12);
  EXPECT_EQ(requests_[0].zoom, 0.5);
  EXPECT_FALSE(requests_[0].home);
  EXPECT_FALSE(requests_[0].record);
  EXPECT_TRUE(requests_[1].home);
  EXPECT_EQ(requests_[2].record, true);
}

TEST_F(Page, RefusesViewRequestsThatMakeNoSenseAndSaysWhatIsAllowed) {
  serve();
  const std::vector<std::pair<const char*, const char*>> cases{
      {R"({"zoom":1})", "\"view\""},
      {R"({"view":"roof"})", "main, hit, tool"},
      {R"({"view":"main","zoom":0})", "from 0.1 to 10"},
      {R"({"view":"main","zoom":"near"})", "from 0.1 to 10"},
      {R"({"view":"main","orbit_deg":[1]})", "[azimuth, elevation]"},
      {R"({"view":"main","orbit_deg":[1,1e9]})", "from -180 to 180"},
      {R"({"view":"main","record":1})", "true or false"},
      {R"({"view":"main","home":"yes"})", "true or false"},
      {R"({"view":"main","fly":true})", "unknown key 'fly'"},
      {"[]", "JSON object"}};
  for (const auto& [body, part] : cases) {
    const auto [status, message] = post(body, {}, "application/json", "/view");
    EXPECT_EQ(status, 400) << body;
    EXPECT_THAT(message, HasSubstr(part)) << body;
  }
  EXPECT_TRUE(requests_.empty());
}

TEST_F(Page, PassesOnWhatIsToBeTakenOrPutDownAndRefusesWhatMakesNoSense) {
  serve();
  const auto carry = [this](const char* body) { return post(body, {}, "application/json", "/carry"); };
  EXPECT_EQ(carry(R"({"object":"pump","attach":true})").first, 200);
  outcome_ = {CommandOutcome::Kind::kRefused, "'pump' (object 2) is carried by no arm"};
  EXPECT_EQ(carry(R"({"object":"pump","attach":false})"),
            std::pair(409, std::string("'pump' (object 2) is carried by no arm")));
  ASSERT_EQ(carries_.size(), 2U);
  EXPECT_EQ(carries_[0].object, "pump");
  EXPECT_TRUE(carries_[0].attach);
  EXPECT_FALSE(carries_[1].attach);
  for (const char* body :
       {"[]", R"({"object":"pump"})", R"({"object":"","attach":true})", R"({"object":7,"attach":true})",
        R"({"object":"pump","attach":1})", R"({"object":"pump","attach":true,"arm":"left"})"})
    EXPECT_EQ(carry(body).first, 400) << body;
  EXPECT_EQ(post(R"({"object":"pump","attach":true})", {{"Origin", "http://elsewhere.example"}},
                 "application/json", "/carry")
                .first,
            403);
  EXPECT_EQ(carries_.size(), 2U);
}

TEST_F(Page, PassesOnWhatIsToBeCorrectedOrUndoneAndRefusesWhatMakesNoSense) {
  serve();
  const auto model = [this](const char* body) { return post(body, {}, "application/json", "/model"); };
  EXPECT_EQ(model(R"({"correct":17})").first, 200);
  EXPECT_EQ(model(R"({"undo":"pump"})").first, 200);
  EXPECT_EQ(model(R"({"found":"drum"})").first, 200);
  EXPECT_EQ(model(R"({"discard":"live object 1"})").first, 200);
  EXPECT_EQ(model(R"({"call":"live object 1","name":"bucket"})").first, 200);
  ASSERT_EQ(corrections_.size(), 5U);
  EXPECT_EQ(corrections_[2].found, "drum");
  EXPECT_EQ(corrections_[3].live, "live object 1");
  EXPECT_EQ(corrections_[3].decision, messages::WorkspaceOperation::kDiscard);
  EXPECT_EQ(corrections_[4].decision, messages::WorkspaceOperation::kName);
  EXPECT_EQ(corrections_[4].name, "bucket");
  EXPECT_EQ(corrections_[0].doubt, 17U);
  EXPECT_EQ(corrections_[0].undo, "");
  EXPECT_EQ(corrections_[1].undo, "pump");
  for (const char* body :
       {"[]", "{}", R"({"correct":0})", R"({"correct":-1})", R"({"correct":1.5})", R"({"correct":"3"})",
        R"({"undo":true})", R"({"undo":""})", R"({"undo":"pump","correct":3})", R"({"found":7})",
        R"({"found":""})", R"({"freeze":""})", R"({"freeze":7})", R"({"freeze":"a","name":"b"})",
        R"({"call":"a"})", R"({"call":"a","name":""})", R"({"restore":"a","undo":"b"})"})
    EXPECT_EQ(model(body).first, 400) << body;
  EXPECT_EQ(corrections_.size(), 5U);
}

TEST_F(Page, ViewRequestsPassTheSameChecksAsCommands) {
  PageConfig config;
  config.allow_commands = false;
  serve(config);
  const char* body = R"({"view":"main","zoom":2})";
  const auto refused = post(body, {}, "application/json", "/view");
  EXPECT_EQ(refused.first, 403);
  EXPECT_THAT(refused.second, HasSubstr("page.allow_commands"));
  serve();
  EXPECT_EQ(post(body, {}, "text/plain", "/view").first, 403);
  EXPECT_EQ(post(body, {{"Origin", "http://elsewhere.example"}}, "application/json", "/view").first, 403);
  EXPECT_TRUE(requests_.empty());
}

// One browser that takes in next to nothing: the others get every picture, and the publisher never waits.
// Tries synthetic_viewer: a browser that reads slowly
TEST_F(Page, ABrowserThatReadsSlowlyHoldsUpNobody) {
  serve();
  const std::string picture = "\xFF\xD8" + std::string(300'000, 'x');
  std::atomic<bool> enough{false};
  std::atomic<int> quick{0};
  std::thread slow([&] {
    follow("/stream/main", [&](const std::string&) {
      for (int k = 0; k < 100 && !enough; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      return enough.load();
    });
  });
  std::thread fast([&] {
    follow("/stream/main", [&](const std::string& text) {
      quick =
          count(text.substr(text.size() - std::min<std::size_t>(text.size(), 1'000'000)), "Content-Length");
      return enough.load();
    });
  });
  auto& jpeg = content_.view(View::kMain).jpeg;
  for (int k = 0; k < 500 && jpeg.followers < 2; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(jpeg.followers, 2);
  double longest_s = 0;
  std::size_t published = 0;
  for (int k = 0; k < 3000 && quick < 3; ++k, ++published) {
    const auto begin = std::chrono::steady_clock::now();
    jpeg.publish(picture);
    longest_s =
        std::max(longest_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_GE(quick, 3) << "after " << published << " pictures";
  EXPECT_LT(longest_s, 1.0) << "publishing waited for a browser";
  enough = true;
  server_.reset();
  slow.join();
  fast.join();
}

TEST_F(Page, TellsWhatBecameOfACommand) {
  serve();
  using Kind = CommandOutcome::Kind;
  for (const auto& [kind, status] :
       {std::pair{Kind::kDone, 200}, {Kind::kRefused, 409}, {Kind::kUnanswered, 504}}) {
    outcome_ = {kind, "NOT CONFIRMED by slave_io; stopped: master_io"};
    const auto result = client().Post("/command", R"({"kind":"emergency_stop"})", "application/json");
    ASSERT_TRUE(result);
    EXPECT_EQ(result->status, status);
    const auto json = nlohmann::json::parse(result->body);
    EXPECT_EQ(json.at("ok"), status == 200);
    EXPECT_EQ(json.at("message"), outcome_.message);
  }
}

TEST_F(Page, TellsWhoIsStoppedWithoutWaitingForAPicture) {
  serve();
  EXPECT_EQ(nlohmann::json::parse(client().Get("/stop")->body).at("in_force"), false);
  content_.stops = [] {
    StopView view;
    view.in_force = view.alarm = true;
    view.sides[1] = {SideView::Level::kAlarm, "HAS NOT CONFIRMED THE STOP"};
    return view;
  };
  const auto json = nlohmann::json::parse(client().Get("/stop")->body);
  EXPECT_EQ(json.at("alarm"), true);
  EXPECT_EQ(json.at("sides").at("slave").at("text"), "HAS NOT CONFIRMED THE STOP");
}

// For a window to which no stream comes.
TEST_F(Page, GivesTheStateToThoseWhoAskForIt) {
  serve();
  EXPECT_FALSE(content_.state_wanted(core::monotonic_ns()));
  EXPECT_EQ(client().Get("/state")->status, 503) << "there is none yet";
  EXPECT_TRUE(content_.state_wanted(core::monotonic_ns())) << "so that one is made";
  content_.state.publish(nlohmann::json{{"t", 1}});
  EXPECT_EQ(client().Get("/state")->body, R"({"t":1})");
  EXPECT_FALSE(content_.state_wanted(core::monotonic_ns() + 10 * core::kNsPerSecond));
}

TEST_F(Page, GivesTheStateToTheFirstWhoAsksAfterAWhile) {
  content_.wake = [this] { content_.state.publish(nlohmann::json{{"t", 2}}); };
  serve();
  const auto answer = client().Get("/state");
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(answer->body, R"({"t":2})");
}

TEST_F(Page, ThePageMayTakeStreamsFromTheirPortAndNobodyElseMayReadThem) {
  serve();
  const std::string streams = "http://127.0.0.1:" + std::to_string(server_->stream_port());
  const std::string page = "http://127.0.0.1:" + std::to_string(server_->port());
  const auto index = client().Get("/");
  const std::string policy = index->get_header_value("Content-Security-Policy");
  EXPECT_THAT(policy, HasSubstr("connect-src 'self' " + streams + " ws" + streams.substr(4) + ";"));
  EXPECT_THAT(policy, HasSubstr("img-src 'self' data: " + streams + ";"));
  EXPECT_THAT(index->body,
              HasSubstr("name=\"stream-port\" content=\"" + std::to_string(server_->stream_port()) + "\""));
  const auto rebound = client().Get("/", {{"Host", "a; script-src *"}});
  EXPECT_EQ(rebound->get_header_value("Content-Security-Policy").find("script-src"), std::string::npos);
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  const auto allowed = [&](const std::string& origin) {
    std::string value;
    stream_client().Get(
        "/stream/main", {{"Origin", origin}},
        [&](const httplib::Response& response) {
          value = response.get_header_value("Access-Control-Allow-Origin");
          return false;
        },
        [](const char*, std::size_t) { return false; });
    return value;
  };
  EXPECT_EQ(allowed(page), page);
  EXPECT_EQ(allowed("http://127.0.0.1:1"), "");
  EXPECT_EQ(allowed("http://elsewhere.example"), "");
}

// Tries synthetic_viewer: port taken
TEST_F(Page, ATakenPortIsAnErrorThatNamesIt) {
  serve();
  PageConfig config;
  config.port = server_->port();
  PageContent other;
  try {
    WebServer second(
        config, other, [](const Command&) { return CommandOutcome(); },
        [](const ViewRequest&) { return core::Status::ok(); });
    FAIL() << "two servers on one port";
  } catch (const core::MissingError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr(std::to_string(config.port)));
    EXPECT_THAT(problem.what(), HasSubstr("page.port"));
  }
}

TEST_F(Page, EndsWithStreamsAndIdleConnectionsOpen) {
  serve();
  content_.view(View::kMain).jpeg.publish(std::string("\xFF\xD8 picture"));
  std::thread follower([this] { follow("/stream/main", [](const std::string&) { return false; }); });
  for (int k = 0; k < 500 && content_.view(View::kMain).jpeg.followers < 1; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  server_.reset();  // returns, though nobody hangs up
  follower.join();
  EXPECT_EQ(content_.view(View::kMain).jpeg.followers, 0);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
