// The demo, recorded: others read the recording, and phantom_sensing makes its percepts again from it, bit
// for bit, and the operator's page shows it again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::end_to_end {
namespace {

using test::Process;

class RecordedDemo : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::filesystem::remove_all(folder());
    std::filesystem::create_directories(folder());
    RunningSystem system(12.0);
    Process recorder({PHANTOM_BIN_DIR "/dds_recorder", "record", "--domain",
                      std::to_string(system.network().domain), "--folder", (folder() / "out").string()},
                     folder() / "record.log");
    session_code_ = system.wait();
    recorder_code_ = recorder.end(SIGINT);
    if (session_code_ != 0) std::cerr << system.output();
    for (const auto& entry : std::filesystem::directory_iterator(folder() / "out")) file_ = entry.path();
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }
  static std::filesystem::path folder() {
    return std::filesystem::temp_directory_path() / ("phantom_recorded_demo_" + std::to_string(getpid()));
  }
  static std::pair<int, std::string> run(const std::vector<std::string>& arguments) {
    Process process(arguments, folder() / "run.log");
    const int code = process.wait();
    return {code, process.output()};
  }
  /// What the page says of a moment of a recording that stands still.
  static nlohmann::json moment(httplib::Client& page, double t_s) {
    const std::string there = nlohmann::json{{"t", t_s}, {"play", false}}.dump();
    const auto answer = page.Post("/review", there, "application/json");
    EXPECT_TRUE(answer && answer->status == 200) << (answer ? answer->body : "no answer");
    nlohmann::json before, now;
    EXPECT_TRUE(eventually([&] {  // until a round has shown it as a whole
      before = std::exchange(now, nlohmann::json());
      const auto state = page.Get("/state");
      if (!state || state->status != 200) return false;
      now = nlohmann::json::parse(state->body);
      return !before.is_null() && std::abs(now["review"]["t"].get<double>() - t_s) < 1e-3 &&
             before["review"] == now["review"] && before["joints"] == now["joints"] &&
             before["percept"] == now["percept"];
    })) << now;
    return now;
  }
  static inline int session_code_ = -1, recorder_code_ = -1;
  static inline std::filesystem::path file_;
};

TEST_F(RecordedDemo, HoldsEveryTopicOfTheSystemAndPassesTheCheck) {
  EXPECT_EQ(session_code_, 0);
  EXPECT_EQ(recorder_code_, 0) << read_text(folder() / "record.log");
  EXPECT_EQ(run({PHANTOM_BIN_DIR "/dds_recorder", "check", file_.string()}).first, 0);
  const auto [code, text] = run({PHANTOM_BIN_DIR "/dds_recorder", "info", "--json", file_.string()});
  ASSERT_EQ(code, 0);
  const auto info = nlohmann::json::parse(text)[0];
  EXPECT_TRUE(info["complete"]);
  for (const char* topic :
       {"master_state", "slave_state", "drag_field", "percept", "interest_points", "hit_alert",
        "workspace_brick", "workspace_version", "workspace_object", "mesh_chunk", "component_status"})
    EXPECT_GT(info["topics"].value(topic, nlohmann::json::object()).value("samples", 0), 0) << topic;
  EXPECT_GT(info["topics"].value("slave_state", nlohmann::json::object()).value("samples", 0), 5000)
      << "12 s at 1 kHz, on a host that is busy with all of it";
}

TEST_F(RecordedDemo, GivesThePerceptsAgainBitForBit) {
  const auto [code, said] = run({PHANTOM_BIN_DIR "/phantom_sensing", "replay", "--recording", file_.string(),
                                 "--cell", PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml"});
  EXPECT_EQ(code, 0) << said;
  std::smatch found;
  ASSERT_TRUE(std::regex_search(said, found, std::regex("drag_field: (\\d+) equal bit for bit, 0 different")))
      << said;
  EXPECT_GT(std::stoi(found[1]), 3000) << said;
  ASSERT_TRUE(std::regex_search(said, found, std::regex("percept: (\\d+) equal bit for bit, 0 different")))
      << said;
  EXPECT_GT(std::stoi(found[1]), 300) << said;
}

TEST_F(RecordedDemo, IsShownAgainOnTheOperatorsPageAtAnyOfItsMoments) {
  Process review({PHANTOM_BIN_DIR "/synthetic_viewer", "review", file_.string(), "--cell",
                  PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml", "--port", "0"},
                 folder() / "review.log");
  std::smatch address;
  std::string said;
  ASSERT_TRUE(eventually([&] {
    said = review.output();
    return std::regex_search(said, address, std::regex("review of .*: http://127.0.0.1:(\\d+)"));
  })) << said;
  httplib::Client page("127.0.0.1", std::stoi(address[1]));
  page.set_read_timeout(60);
  const auto told = page.Get("/review");
  ASSERT_TRUE(told && told->status == 200);
  const auto facts = nlohmann::json::parse(told->body);
  const double duration_s = facts["duration_s"];
  EXPECT_GT(duration_s, 10.0);
  EXPECT_EQ(facts["problems"], nlohmann::json::array());
  EXPECT_GT(facts["series"].size(), 10U);

  const auto early = moment(page, 0.4 * duration_s), late = moment(page, 0.8 * duration_s);
  for (const auto& shown : {early, late}) {
    EXPECT_TRUE(shown["percept"]["known"]) << shown;
    EXPECT_GT(shown["objects"].size(), 5U);
    EXPECT_LT(shown["link"]["slave_age_s"].get<double>(), 0.5) << "as old as it was then";
  }
  EXPECT_NE(early["percept"], late["percept"]);
  EXPECT_EQ(moment(page, 0.4 * duration_s)["percept"], early["percept"]) << "and back";
  const auto picture = page.Get("/snapshot/main.png");
  ASSERT_TRUE(picture && picture->status == 200);
  EXPECT_THAT(picture->body, testing::StartsWith("\x89PNG"));
  EXPECT_EQ(review.end(SIGTERM), 0) << review.output();
}

TEST_F(RecordedDemo, IsReadByOtherPeoplesReader) {
  setenv("READERS", PHANTOM_READERS, 1);
  const std::string script = PHANTOM_SOURCE_DIR "/tests/recording/read_recording.mjs";
  const auto [code, said] = run({PHANTOM_NODE, script, file_.string()});
  ASSERT_EQ(code, 0) << said;
  const auto all = nlohmann::json::parse(said);
  EXPECT_GT(all["messages"], 10'000);
  // Field by field without the bulky ones.
  const auto part = (folder() / "part.mcap").string(), lines = (folder() / "part.jsonl").string();
  EXPECT_EQ(run({PHANTOM_BIN_DIR "/dds_recorder", "convert", file_.string(), "--out", part, "--from", "3",
                 "--until", "6", "--topics", "!workspace_brick", "!mesh_chunk"})
                .first,
            0);
  EXPECT_EQ(run({PHANTOM_BIN_DIR "/dds_recorder", "convert", part, "--out", lines}).first, 0);
  const auto [compared_code, compared_said] = run({PHANTOM_NODE, script, part, lines});
  ASSERT_EQ(compared_code, 0) << compared_said;
  EXPECT_GT(nlohmann::json::parse(compared_said)["numbers"], 50'000);
}

}  // namespace
}  // namespace phantom::end_to_end
