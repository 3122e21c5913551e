// A recorded session on the page: what it answers, and to whom.
#include "components/synthetic_viewer/page/page_review.hpp"

#include <unistd.h>

#include <filesystem>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "components/synthetic_viewer/review/tests/recorded_session.hpp"

namespace phantom::synthetic_viewer {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class ReviewPage : public test::Page {
 protected:
  ReviewPage() {
    std::filesystem::create_directories(folder_);
    test::RecordingWriter writer(folder_ / "session.mcap");
    test::write_session(writer, cell_.arm().home, arm_.links().size(), 5, 50, 1);
    writer.finish();
    review_ = std::make_unique<Review>(recording::open_recordings({folder_ / "session.mcap"}), arm_);
    content_.review = review_.get();
    content_.wake = [this] { ++woken_; };
  }
  ~ReviewPage() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }
  std::pair<int, std::string> go(const std::string& body, const httplib::Headers& headers = {}) const {
    return post(body, headers, "application/json", "/review");
  }
  double t() const {
    return core::seconds(review_->position(core::monotonic_ns()).at_ns - review_->begin_ns());
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("page_review_" + std::to_string(getpid()));
  const runtime::CellConfig cell_ =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml");
  const robot::SerialArm arm_ = runtime::load_arm(cell_.arm());
  std::unique_ptr<Review> review_;
  std::atomic<int> woken_{0};
};

TEST_F(ReviewPage, SaysWhatTheRecordingHas) {
  serve();
  const auto answer = client().Get("/review");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  const json facts = json::parse(answer->body);
  EXPECT_DOUBLE_EQ(facts.at("duration_s"), review_->duration_s());
  ASSERT_EQ(facts.at("alerts").size(), review_->marks().size());
  ASSERT_GT(review_->marks().size(), 1U);
  EXPECT_EQ(facts["alerts"][1]["alert"], review_->marks()[1].alert);
  EXPECT_EQ(facts["alerts"][1]["object"], "upright");
  EXPECT_DOUBLE_EQ(facts["alerts"][1]["t"],
                   core::seconds(review_->marks()[1].raised_ns - review_->begin_ns()));
  EXPECT_EQ(facts["series"][0]["name"], "closeness");
  EXPECT_EQ(facts["link_states"][3], "COUPLED");
}

TEST_F(ReviewPage, GivesNumbersForPlots) {
  serve();
  const auto answer = client().Get("/review/series?names=closeness,percept/0&from=-1&to=4&columns=10");
  ASSERT_TRUE(answer);
  ASSERT_EQ(answer->status, 200) << answer->body;
  const json series = json::parse(answer->body);
  const auto closeness = review_->series()[0].values.columns(
      review_->begin_ns() - core::kNsPerSecond, review_->begin_ns() + 4 * core::kNsPerSecond, 10);
  for (std::size_t i = 0; i < 10; ++i) {
    const json& least = series["series"]["closeness"]["least"][i];
    EXPECT_EQ(least.is_null(), std::isnan(closeness[i].least)) << i;
    if (!least.is_null()) {
      EXPECT_NEAR(least.get<double>(), closeness[i].least, 1e-3);
    }
  }
  EXPECT_EQ(series["series"]["percept/0"]["greatest"].size(), 10U);
  const auto refused = [this](const std::string& query) {
    const auto result = client().Get("/review/series?" + query);
    return std::pair(result ? result->status : 0,
                     result ? json::parse(result->body).at("message").get<std::string>() : "");
  };
  EXPECT_EQ(refused("names=nothing&from=0&to=1&columns=5").first, 404);
  EXPECT_THAT(refused("from=0&to=1&columns=5").second, HasSubstr("names must be"));
  for (const char* range : {"from=1&to=1", "from=2&to=1", "from=x&to=1", "to=1", "from=0&to=1e300",
                            "from=nan&to=1", "from=0&to=inf"})
    EXPECT_THAT(refused(std::string("names=speed&columns=5&") + range).second,
                HasSubstr("from and to must be"))
        << range;
  for (const char* count : {"0", "4001", "1.5", "-3", "", "1e99"})
    EXPECT_THAT(refused(std::string("names=speed&from=0&to=1&columns=") + count).second,
                HasSubstr("columns must be"))
        << count;
}

TEST_F(ReviewPage, GoesWhereItIsAsked) {
  serve();
  EXPECT_EQ(go(R"({"t": 2.5})"), std::pair(200, std::string("done")));
  EXPECT_NEAR(t(), 2.5, 1e-6);
  EXPECT_EQ(woken_, 1);
  EXPECT_EQ(go(R"({"play": true, "rate": 0.5})").first, 200);
  EXPECT_TRUE(review_->position(core::monotonic_ns()).playing);
  EXPECT_EQ(go(R"({"t": 99})").first, 400);
  EXPECT_THAT(go(R"({"t": "now"})").second, HasSubstr("t must be a number"));
  EXPECT_THAT(go(R"({"speed": 1})").second, HasSubstr("allowed are t, play and rate"));
  EXPECT_THAT(go(R"({"play": 1})").second, HasSubstr("true or false"));
  EXPECT_EQ(go("[]").first, 400);
  EXPECT_EQ(go(R"({"t": 1})", {{"Origin", "http://elsewhere.example"}}).first, 403);
}

TEST_F(ReviewPage, NothingIsCommandedOfARecording) {
  serve();
  for (const char* kind : {"emergency_stop", "reset", "home", "mark"}) {
    const auto [status, message] = post(std::string(R"({"kind": ")") + kind + R"("})");
    EXPECT_EQ(status, 403) << kind;
    EXPECT_THAT(message, HasSubstr("this is a recording")) << kind;
  }
  EXPECT_EQ(post(R"({"kind": "set_percept_gain", "value": 1})").first, 403);
  EXPECT_EQ(post(R"({"object": "upright", "attach": true})", {}, "application/json", "/carry").first, 403);
  EXPECT_TRUE(commands_.empty());
  EXPECT_TRUE(carries_.empty());
  EXPECT_EQ(post(R"({"kind": "view_node", "value": 9})").first, 200);  // a view is nobody's arm
  EXPECT_EQ(commands_.size(), 1U);
}

TEST_F(ReviewPage, ALivePageHasNoReview) {
  content_.review = nullptr;
  serve();
  EXPECT_EQ(client().Get("/review")->status, 404);
  EXPECT_EQ(client().Get("/review/series?names=speed&from=0&to=1&columns=5")->status, 404);
  EXPECT_EQ(go(R"({"t": 1})").first, 404);
}

TEST_F(ReviewPage, RolesHoldForARecordingToo) {
  serve({.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"})});
  EXPECT_EQ(client().Get("/review")->status, 401);
  EXPECT_EQ(client().Get("/review/series?names=speed&from=0&to=1&columns=5")->status, 401);
  EXPECT_EQ(go(R"({"t": 1})").first, 401);
  const auto cookie_of = [this](const std::string& secret) {
    const auto answer = client().Post("/login", json{{"secret", secret}}.dump(), "application/json");
    const std::string set = answer->get_header_value("Set-Cookie");
    return httplib::Headers{{"Cookie", set.substr(0, set.find(';'))}};
  };
  const auto watch = cookie_of("watch-watch-watch"), operate = cookie_of("operate-operate-1");
  EXPECT_EQ(client().Get("/review", watch)->status, 200);
  EXPECT_EQ(client().Get("/review/series?names=speed&from=0&to=1&columns=5", watch)->status, 200);
  const double before = t();
  EXPECT_EQ(go(R"({"t": 1})", watch).first, 403);
  EXPECT_EQ(t(), before);
  EXPECT_EQ(go(R"({"t": 1})", operate).first, 200);
  EXPECT_EQ(client().Get("/review.js")->status, 200);  // the page's own files
}

TEST_F(ReviewPage, WhoOnlyShowsDoesNotGoElsewhere) {
  serve({.allow_commands = false});
  EXPECT_EQ(go(R"({"t": 1})").first, 403);
  EXPECT_EQ(client().Get("/review")->status, 200);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
