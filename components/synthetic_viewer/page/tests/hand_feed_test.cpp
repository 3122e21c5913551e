// The hand over the scene stream: who may lead, and what becomes of it when a page breaks the rules or goes.
#include <algorithm>

#include "components/synthetic_viewer/page/tests/scene_stream_rig.hpp"
#include "components/synthetic_viewer/stream/tests/hand_messages.hpp"

namespace phantom::synthetic_viewer::hand_feed_test {
namespace {

using phantom::test::eventually;
using test::RawClient;
using web::test::client_frame;

const std::string kAsk = client_frame(1, R"({"hand":1})"), kGiveBack = client_frame(1, R"({"hand":0})");

class HandStream : public test::SceneStream {
 protected:
  HandStream() { hand_ = &lead_; }
  ~HandStream() override { server_.reset(); }
  /// Waits until a follower is told so.
  bool told(RawClient& client, const std::string& word) {
    return client.read_until([&] { return client.scene.hand == word; });
  }
  std::string next_pose() {
    ++message_.number;
    message_.page_s = core::seconds(core::monotonic_ns());
    return client_frame(2, test::hand_message(message_));
  }
  /// A pose at a time, as a headset sends them, until `enough`.
  bool leads_until(RawClient& client, const std::function<bool()>& enough) {
    return client.read_until([&] {
      client.put(next_pose());
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      handle_ = lead_.step({robot::Spatial::Zero(), true, true}, 0.05, core::monotonic_ns());
      return enough();
    });
  }
  void take_hand(RawClient& client) {
    ASSERT_TRUE(client.put(kAsk));
    ASSERT_TRUE(leads_until(client, [&] { return client.scene.hand == "ready"; })) << client.scene.hand;
    message_.grip = true;
    ASSERT_TRUE(leads_until(client, [&] { return client.scene.hand == "leads"; })) << client.scene.hand;
  }
  bool stands() {
    handle_ = lead_.step({robot::Spatial::Zero(), true, true}, 0.002, core::monotonic_ns());
    return !handle_.hand.clutch && !handle_.hand.valid;
  }

  HeadsetHand lead_{60.0, Eigen::Matrix3d::Identity()};  // a busy machine is no silence
  HeadsetHand::Handle handle_;
  test::HandMessage message_;
};

TEST_F(HandStream, OneFollowerLeadsAndTheOthersAreTold) {
  serve_scene();
  RawClient &first = follow_scene(), &second = follow_scene();
  EXPECT_TRUE(told(first, "free"));
  EXPECT_TRUE(told(second, "free"));
  take_hand(first);
  EXPECT_TRUE(told(second, "elsewhere"));
  second.scene.hand.clear();
  EXPECT_TRUE(second.put(kAsk));
  EXPECT_TRUE(told(second, "elsewhere")) << "who asks is answered";
  const double before = handle_.hand.pose.translation_m.x();
  EXPECT_TRUE(leads_until(first, [&] {
    message_.position_m.x() += 0.001;
    return handle_.hand.pose.translation_m.x() > before + 0.005;
  }));
  EXPECT_TRUE(first.put(kGiveBack));
  EXPECT_TRUE(told(first, "free"));
  EXPECT_TRUE(told(second, "free"));
  EXPECT_TRUE(stands());
  EXPECT_TRUE(first.put(next_pose())) << "what was on its way is passed over";
  EXPECT_TRUE(second.put(kAsk));
  EXPECT_TRUE(told(second, "clutch_in"));
  EXPECT_EQ(first.code, 0);
}

// Tries synthetic_viewer: the page of a controller that leads goes
TEST_F(HandStream, WhoGoesLetsGo) {
  serve_scene();
  take_hand(follow_scene());
  clients_.clear();
  EXPECT_TRUE(eventually([&] { return stands(); }));
  RawClient& next = follow_scene();
  EXPECT_TRUE(told(next, "free"));
  EXPECT_TRUE(next.put(kAsk));
  EXPECT_TRUE(told(next, "clutch_in"));
}

// Tries synthetic_viewer: who asks for the hand may not command
TEST_F(HandStream, WhoMayNotCommandDoesNotLeadAndWhoseSessionEndsLetsGo) {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve_scene(config);
  const auto cookie_of = [&](const std::string& secret) {
    const auto login = client().Post("/login", R"({"secret":")" + secret + "\"}", "application/json");
    std::string cookie = login->get_header_value("Set-Cookie");
    return cookie.substr(0, cookie.find(';'));
  };
  const std::string operates = cookie_of("operate-operate-1");
  RawClient& onlooker =
      follow_scene(RawClient::kUpgrade + "Cookie: " + cookie_of("watch-watch-watch") + "\r\n");
  RawClient& person = follow_scene(RawClient::kUpgrade + "Cookie: " + operates + "\r\n");
  EXPECT_TRUE(onlooker.put(kAsk));
  EXPECT_TRUE(told(onlooker, "forbidden"));
  take_hand(person);
  ASSERT_EQ(client().Post("/logout", {{"Cookie", operates}}, "{}", "application/json")->status, 200);
  EXPECT_TRUE(person.is_closed_with(4001));
  EXPECT_TRUE(eventually([&] { return stands(); }));
}

TEST_F(HandStream, NobodyLeadsWhereThePageMayNotCommand) {
  PageConfig config;
  config.allow_commands = false;
  serve_scene(config);
  RawClient& client = follow_scene();
  EXPECT_TRUE(client.put(kAsk));
  EXPECT_TRUE(told(client, "forbidden"));
}

TEST_F(HandStream, WhoBreaksTheRulesIsClosedAndLetsGo) {
  serve_scene();
  const std::string pose = test::hand_message(message_);
  for (const std::string& bad : {std::string("hi"), pose.substr(1), pose + "x", std::string(128, '\3')}) {
    RawClient& client = follow_scene();
    message_ = {};
    take_hand(client);
    EXPECT_TRUE(client.put(client_frame(2, bad)));
    EXPECT_TRUE(client.is_closed_with(1007)) << client.code;
    EXPECT_TRUE(eventually([&] { return stands(); }));
  }
  RawClient& flood = follow_scene();
  message_ = {};
  take_hand(flood);
  std::string many;
  for (int i = 0; i < 800; ++i) many += next_pose();
  flood.put(many);
  EXPECT_TRUE(flood.is_closed_with(1008)) << flood.code;
  EXPECT_TRUE(eventually([&] { return stands(); }));
}

TEST_F(HandStream, WhereNoControllerMayLeadNothingIsSaidOfIt) {
  hand_ = nullptr;
  serve_scene();
  RawClient& client = follow_scene();
  EXPECT_TRUE(client.read_until([&] { return client.scene.poses_count >= 2; }));
  EXPECT_EQ(client.scene.hand, "");
  EXPECT_TRUE(client.put(kAsk));
  EXPECT_TRUE(client.is_closed_with(1007));
}

}  // namespace
}  // namespace phantom::synthetic_viewer::hand_feed_test
