// The scene stream as a whole: server, thread and followers, well-behaved and hostile, over real sockets.
#include "components/synthetic_viewer/stream/scene_feed.hpp"

#include <set>

#include "common/web/tests/certificate.hpp"
#include "common/web/tls_context.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/page/tests/scene_stream_rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer::scene_feed_test {
namespace {

using phantom::test::eventually;

using test::RawClient;
using test::SceneStream;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using web::test::client_frame;

TEST_F(SceneStream, BeginsWithAHandshakeAndTheWholeScene) {
  serve_scene();
  EXPECT_EQ(content_.scene.followers, 0);
  RawClient& client = follow_scene(RawClient::kUpgrade + "Origin: " + origin() + "\r\n");
  EXPECT_EQ(client.head,
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n");
  ASSERT_TRUE(client.read_until([&] { return client.scene.poses_count >= 3; }));
  EXPECT_EQ(client.scene.cell.at("cell"), "two plates");
  EXPECT_EQ(client.scene.view.at("banner").at("key"), "banner.no_slave");
  EXPECT_EQ(content_.scene.followers, 1);
  EXPECT_TRUE(std::ranges::none_of(content_.views, &ViewOutput::followed)) << "no picture is drawn for it";
  clients_.clear();
  EXPECT_TRUE(eventually([&] { return content_.scene.followers == 0; }));
}

TEST_F(SceneStream, NumbersComeToEverybodyAndTheSceneToWhoAsks) {
  serve_scene();
  move();
  content_.state.publish(nlohmann::json{{"t", 1}, {"link", {{"slave", "COUPLED"}, {"age_s", 0.1}}}});
  RawClient& client = follow_numbers();
  ASSERT_TRUE(client.read_until([&] { return client.scene.state.is_object(); }));
  EXPECT_EQ(client.scene.state.at("link").at("slave"), "COUPLED");
  content_.state.publish(nlohmann::json{{"t", 2}, {"link", {{"slave", "COUPLED"}, {"age_s", 0.1}}}});
  ASSERT_TRUE(client.read_until([&] { return client.scene.state.at("t") == 2; }));
  EXPECT_EQ(client.scene.told_state.back(), R"({"t":2,"type":"state"})") << "what has changed";
  ASSERT_TRUE(client.read_until([&] { return client.scene.alive_count >= 5; }));
  EXPECT_EQ(client.scene.poses_count + client.scene.paint_count, 0);
  EXPECT_TRUE(client.scene.cell.is_null() && client.scene.view.is_null() && client.scene.items.empty());
  EXPECT_EQ(content_.scene.followers, 0) << "nothing of the scene is made for it";
  EXPECT_EQ(content_.state.followers, 1);
  EXPECT_TRUE(client.put(client_frame(1, R"({"rate_Hz":60})")));
  ASSERT_TRUE(client.read_until([&] { return client.scene.poses_count >= 10; }));
  EXPECT_EQ(client.scene.cell.at("cell"), "two plates");
  EXPECT_EQ(content_.scene.followers, 1);
  EXPECT_TRUE(client.put(client_frame(1, R"({"rate_Hz":0})")));
  EXPECT_TRUE(client.read_until([&] { return content_.scene.followers == 0; }));
  const int alive = client.scene.alive_count;
  ASSERT_TRUE(client.read_until([&] { return client.scene.alive_count >= alive + 2; }));
  const int poses = client.scene.poses_count;
  client.scene.cell = nullptr;
  ASSERT_TRUE(client.read_until([&] { return client.scene.alive_count >= alive + 5; }));
  EXPECT_EQ(client.scene.poses_count, poses) << "it has let go of the scene";
  EXPECT_TRUE(client.put(client_frame(1, R"({"rate_Hz":60})")));
  EXPECT_TRUE(client.read_until([&] { return client.scene.cell.is_object(); })) << "and gets all of it again";
  clients_.clear();
  EXPECT_TRUE(eventually([&] { return content_.state.followers == 0 && content_.scene.followers == 0; }));
}

// Two hundred alerts while one follower reads nothing: it is told those that are kept, in the end.
// Tries synthetic_viewer: more alerts than 40 at once
TEST_F(SceneStream, WhoReadsLateMissesNoAlertThatIsKept) {
  serve_scene();
  RawClient &quick = follow_numbers(), &late = follow_numbers();
  ViewerState state;
  const PageFacts facts{"two plates", true, true, 10.0, "test", 0, {}, {}};
  const auto publish = [&] {
    content_.state.publish(page_state(state, *cell_scene_, {}, {}, facts, core::monotonic_ns()));
  };
  std::uint64_t told = 0;
  for (std::uint32_t alert = 1; alert <= 200; ++alert) {
    HitSample hit;
    hit.alert = alert;
    hit.received_ns = core::monotonic_ns();
    state.take(hit);
    publish();
    if (alert % 3 == 0) {
      hit.cleared = true;
      hit.received_ns += core::kNsPerSecond;
      state.take(hit);
      publish();
    }
    if (alert % 10 != 0) continue;
    ASSERT_TRUE(quick.read_until(
        [&] { return quick.scene.state.is_object() && quick.scene.state.at("total_hits") == alert; }));
    const auto& hits = quick.scene.state.at("hits");
    for (const auto& hit_told : hits) told = std::max(told, hit_told.at("number").get<std::uint64_t>());
    EXPECT_EQ(told, alert);
  }
  ASSERT_TRUE(late.read_until(
      [&] { return late.scene.state.is_object() && late.scene.state.at("total_hits") == 200; }));
  const auto& hits = late.scene.state.at("hits");
  ASSERT_EQ(hits.size(), ViewerState::kMaxHits);
  std::set<std::uint64_t> numbers;
  for (const auto& hit : hits) {
    numbers.insert(hit.at("number").get<std::uint64_t>());
    EXPECT_EQ(hit.at("alert"), hit.at("number"));
    EXPECT_EQ(hit.at("cleared_after_s").is_null(), hit.at("alert").get<int>() % 3 != 0);
  }
  EXPECT_EQ(numbers.size(), ViewerState::kMaxHits);
  EXPECT_EQ(*numbers.begin(), 200 - ViewerState::kMaxHits + 1) << "without a gap";
  EXPECT_EQ(hits, quick.scene.state.at("hits"));
}

TEST_F(SceneStream, PosesFollowTheArm) {
  serve_scene();
  move();
  RawClient& client = follow_scene();
  ASSERT_TRUE(client.read_until([&] { return client.scene.poses_count >= 60; }));
  EXPECT_EQ(client.scene.bodies.size(), cell_scene_->arm().links().size());
  EXPECT_LT(client.scene.arm_age_s, 5.0);
  EXPECT_TRUE(client.put(client_frame(1, R"({"echo":42.5})")));
  EXPECT_TRUE(client.read_until([&] { return client.scene.echo.is_object(); }));
  EXPECT_EQ(client.scene.echo.at("echo"), 42.5);
  EXPECT_TRUE(client.put(client_frame(9, "ping")));
  EXPECT_TRUE(client.read_until([&] { return client.pongs == 1; }));
  // A rate of its own: of one's poses a fifth of the other's.
  RawClient& slower = follow_scene();
  EXPECT_TRUE(slower.put(client_frame(1, R"({"rate_Hz":6})")));
  ASSERT_TRUE(slower.read_until([&] { return slower.scene.poses_count >= 2; }));
  const std::uint32_t first = slower.scene.number;
  const int before = slower.scene.poses_count;
  ASSERT_TRUE(slower.read_until([&] { return slower.scene.poses_count >= before + 6; }));
  EXPECT_GE(slower.scene.number - first, 6 * 3U) << "it skips most";
}

TEST_F(SceneStream, TenFollowersGetTheSame) {
  serve_scene();
  move();
  std::vector<RawClient*> all;
  for (int i = 0; i < 10; ++i) all.push_back(&follow_scene());
  for (RawClient* client : all)
    ASSERT_TRUE(client->read_until([&] { return client->scene.poses_count >= 20; }));
  for (RawClient* client : all) EXPECT_EQ(client->scene.cell, all[0]->scene.cell);
  EXPECT_EQ(content_.scene.followers, 10);
}

TEST_F(SceneStream, OnlyAWebSocketOfThePageItselfIsTaken) {
  serve_scene();
  EXPECT_THAT(follow_scene("Accept: */*\r\n").head, StartsWith("HTTP/1.1 426"));
  EXPECT_THAT(follow_scene("Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 8\r\n"
                           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n")
                  .head,
              StartsWith("HTTP/1.1 426"));
  EXPECT_THAT(follow_scene("Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                           "Sec-WebSocket-Key: short\r\n")
                  .head,
              StartsWith("HTTP/1.1 426"));
  for (const char* origin : {"http://evil.example", "http://127.0.0.1:1", "null"})
    EXPECT_THAT(follow_scene(RawClient::kUpgrade + "Origin: " + origin + "\r\n").head,
                StartsWith("HTTP/1.1 403"))
        << origin;
  EXPECT_EQ(content_.scene.followers, 0);
}

TEST_F(SceneStream, ASessionIsNeededAndItsEndEndsTheStream) {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve_scene(config);
  EXPECT_THAT(follow_scene().head, StartsWith("HTTP/1.1 401"));
  EXPECT_EQ(client().Get("/mesh/0000000000000007")->status, 401);
  const auto login = client().Post("/login", R"({"secret":"watch-watch-watch"})", "application/json");
  ASSERT_TRUE(login);
  std::string cookie = login->get_header_value("Set-Cookie");
  cookie.resize(cookie.find(';'));
  RawClient& client_of_watch = follow_scene(RawClient::kUpgrade + "Cookie: " + cookie + "\r\n");
  ASSERT_TRUE(client_of_watch.read_until([&] { return client_of_watch.scene.poses_count >= 1; }));
  ASSERT_EQ(client().Post("/logout", {{"Cookie", cookie}}, "{}", "application/json")->status, 200);
  EXPECT_TRUE(client_of_watch.is_closed_with(4001));
}

// Tries synthetic_viewer: all streams taken
TEST_F(SceneStream, TakesAPlaceAmongTheStreamsAndGivesItBack) {
  PageConfig config;
  config.max_streams = 2;
  serve_scene(config);
  for (int i = 0; i < 2; ++i) EXPECT_THAT(follow_scene().head, StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(follow_scene().head, StartsWith("HTTP/1.1 503"));
  EXPECT_EQ(stream_client().Get("/stream/main")->status, 503);
  clients_.clear();
  EXPECT_TRUE(eventually([&] {
    const bool taken = follow_scene().head.starts_with("HTTP/1.1 101");
    clients_.clear();
    return taken;
  }));
}

// Tries synthetic_viewer: a follower of the stream that breaks the rules
TEST_F(SceneStream, WhoeverBreaksTheRulesIsClosedAndTheOthersAreNot) {
  serve_scene();
  RawClient& good = follow_scene();
  struct Case {
    const char* what;
    std::string octets;
    int code;
  };
  std::string flood;
  for (int i = 0; i < 40; ++i) flood += client_frame(9, "x");
  for (const Case& one :
       {Case{"not masked", std::string("\x81\x02hi", 4), 1002},
        Case{"huge", std::string("\x81\xFF\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 10) + "maskx", 1009},
        Case{"binary", client_frame(2, "hi"), 1003}, Case{"no JSON", client_frame(1, "hi"), 1007},
        Case{"nothing that is known", client_frame(1, R"({"rate":1})"), 1007},
        Case{"two things", client_frame(1, R"({"echo":1,"rate_Hz":2})"), 1007},
        Case{"a rate that is none", client_frame(1, R"({"rate_Hz":0.5})"), 1007},
        Case{"a number in words", client_frame(1, R"({"rate_Hz":"60"})"), 1007},
        Case{"a flood of pings", flood, 1008}}) {
    RawClient& bad = follow_scene();
    EXPECT_TRUE(bad.put(one.octets)) << one.what;
    EXPECT_TRUE(bad.is_closed_with(one.code)) << one.what << ": " << bad.code;
  }
  const int before = good.scene.poses_count;
  EXPECT_TRUE(good.read_until([&] { return good.scene.poses_count > before + 3; }));
}

// Tries synthetic_viewer: a follower of the stream that reads nothing
TEST_F(SceneStream, WhoReadsNothingIsCutOffAndTheOthersGoOn) {
  serve_scene();
  move();
  RawClient& good = follow_scene();
  // One whose kernel takes little for it, so that it need not be filled for a minute.
  const int stalled = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int little = 2048;
  setsockopt(stalled, SOL_SOCKET, SO_RCVBUF, &little, sizeof little);
  sockaddr_in remote{};
  remote.sin_family = AF_INET;
  inet_pton(AF_INET, "127.0.0.1", &remote.sin_addr);
  remote.sin_port = htons(static_cast<std::uint16_t>(server_->stream_port()));
  ASSERT_EQ(connect(stalled, reinterpret_cast<sockaddr*>(&remote), sizeof remote), 0);
  const std::string request = "GET /scene HTTP/1.1\r\nHost: 127.0.0.1\r\n" + RawClient::kUpgrade + "\r\n";
  ASSERT_EQ(::send(stalled, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  char head[512];
  ASSERT_GT(recv(stalled, head, sizeof head, 0), 0);
  const std::string draws = client_frame(1, R"({"rate_Hz":60})");
  ASSERT_EQ(::send(stalled, draws.data(), draws.size(), 0), static_cast<ssize_t>(draws.size()));
  ASSERT_TRUE(eventually([&] { return content_.scene.followers == 2; }));
  EXPECT_TRUE(good.read_until([&] { return content_.scene.followers == 1; }));
  const int before = good.scene.poses_count;
  EXPECT_TRUE(good.read_until([&] { return good.scene.poses_count > before + 10; }));
  close(stalled);
}

TEST_F(SceneStream, EndsWithAFarewell) {
  serve_scene();
  RawClient& client = follow_scene();
  ASSERT_TRUE(client.read_until([&] { return client.scene.poses_count >= 1; }));
  server_.reset();
  EXPECT_TRUE(client.is_closed_with(1001));
}

TEST_F(SceneStream, GoesByTlsToo) {
  const web::test::Certificate own;
  PageConfig config;
  config.tls = std::make_shared<web::TlsContext>(own.certificate, own.key);
  trusted_ = own.certificate;
  serve_scene(config);
  move();
  RawClient& client_by_tls = follow_scene();
  EXPECT_THAT(client_by_tls.head, StartsWith("HTTP/1.1 101"));
  content_.state.publish(nlohmann::json{{"t", 7}});
  EXPECT_TRUE(client_by_tls.read_until([&] { return client_by_tls.scene.state.is_object(); }));
  EXPECT_EQ(client_by_tls.scene.state.at("t"), 7);
  EXPECT_TRUE(client_by_tls.read_until([&] { return client_by_tls.scene.poses_count >= 30; }));
  EXPECT_TRUE(client_by_tls.put(client_frame(1, R"({"echo":1})")));
  EXPECT_TRUE(client_by_tls.read_until([&] { return client_by_tls.scene.echo.is_object(); }));
  EXPECT_THAT(client().Get("/")->get_header_value("Content-Security-Policy"), HasSubstr(" wss://127.0.0.1:"));
}

TEST_F(SceneStream, MeshesAreFetchedByTheirHash) {
  serve_scene();
  geometry::TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  content_.meshes.put(0xAB, mesh);
  const auto got = client().Get("/mesh/00000000000000ab");
  ASSERT_TRUE(got);
  EXPECT_EQ(got->status, 200);
  EXPECT_EQ(got->get_header_value_count("Cache-Control"), 1U);
  EXPECT_THAT(got->get_header_value("Cache-Control"), HasSubstr("immutable"));
  EXPECT_EQ(got->body.size(), 8U + 12 * 4) << "unpacked by the client";
  EXPECT_EQ(client().Get("/mesh/00000000000000ac")->status, 404);
  for (const char* other : {"/mesh/", "/mesh/ab", "/mesh/00000000000000AB", "/mesh/../stop"})
    EXPECT_EQ(client().Get(other)->status, 404) << other;
  const auto shaders = nlohmann::json::parse(client().Get("/shaders.json")->body);
  for (const char* program : {"mesh", "painted", "flat", "floor", "background"})
    for (const char* part : {"vertex", "fragment"})
      EXPECT_THAT(shaders.at(program).at(part).get<std::string>(), StartsWith("#version 300 es\n"));
}

}  // namespace
}  // namespace phantom::synthetic_viewer::scene_feed_test
