// The assistant's dialogue on a page: over HTTP, as a browser speaks it.
#include "components/workspace_survey/page/survey_page.hpp"

#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "components/workspace_survey/tests/assist_rig.hpp"
#include "components/workspace_survey/tests/page_client.hpp"

namespace phantom::workspace_survey {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

/// Answers lines: "slow" waits until it is let go, others are repeated.
class EchoPage : public testing::Test {
 protected:
  ~EchoPage() override {
    go_.set_value();
    client_.wait_until_ready();
    client_.send("end");
    reader_.join();
  }
  std::ostringstream terminal_;
  SurveyPage page_{0, terminal_};
  PageClient client_{page_.url()};
  std::promise<void> go_;
  std::thread reader_{[this, go = go_.get_future()] {
    page_.words() << "ready\n" << std::flush;
    for (std::string line; std::getline(page_.lines(), line) && line != "end";) {
      if (line == "slow") go.wait();
      page_.words() << "said " << line << '\n' << std::flush;
    }
  }};
};

TEST_F(EchoPage, ALineIsCarriedOutAndItsWordsAreShownHereAndInTheTerminal) {
  ASSERT_TRUE(client_.wait_until_ready());
  EXPECT_EQ(client_.send("jog 0.1 0"), 200);
  ASSERT_TRUE(client_.wait_until_ready());
  EXPECT_THAT(client_.state().at("words").get<std::string>(), HasSubstr("said jog 0.1 0"));
  EXPECT_THAT(terminal_.str(), HasSubstr("ready\njog 0.1 0\nsaid jog 0.1 0\n"));
}

// Tries workspace_survey: a line comes while one is carried out
TEST_F(EchoPage, OnlyOneLineIsCarriedOutAtATime) {
  ASSERT_TRUE(client_.wait_until_ready());
  EXPECT_EQ(client_.send("slow"), 200);
  EXPECT_EQ(client_.send("jog 1 0"), 409);
  EXPECT_THAT(client_.message(), HasSubstr("still carried out"));
}

// Tries workspace_survey: no line, or one of over 300 octets
TEST_F(EchoPage, WhatIsNoLineIsRefused) {
  ASSERT_TRUE(client_.wait_until_ready());
  EXPECT_EQ(client_.send(std::string(301, 'x')), 400);
  EXPECT_THAT(client_.message(), HasSubstr("at most 300 octets"));
  EXPECT_EQ(client_.send("two\nlines"), 400);
  for (const char* body : {"", "[]", "{\"line\": 3}", "{\"lines\": \"x\"}", "{"}) {
    EXPECT_EQ(client_.post(body), 400) << body;
    EXPECT_THAT(client_.message(), HasSubstr("needs {")) << body;
  }
  EXPECT_EQ(client_.send(std::string(300, 'x')), 200) << "the longest";
}

TEST_F(EchoPage, NobodyWithoutTheKeyAndNoForeignPageReadsOrSteers) {
  ASSERT_TRUE(client_.wait_until_ready());
  const std::string wrong_key(32, '0');
  for (const std::string& path : {std::string("/"), std::string("/state"), "/" + wrong_key + "/",
                                  "/" + wrong_key + "/state", client_.key().substr(0, 20) + "/state"}) {
    EXPECT_EQ(client_.status_of(path), 404) << path;
  }
  EXPECT_EQ(client_.post_to("/" + wrong_key + "/line", "{\"line\": \"x\"}", {}, "application/json"), 404);
  EXPECT_EQ(client_.status_of(client_.key() + "/"), 200);
  EXPECT_EQ(client_.status_of(client_.key() + "/", {{"Host", "evil.example:80"}}), 403)
      << "a name that is rebound";
  EXPECT_EQ(client_.status_of(client_.key() + "/state", {{"Origin", "http://evil.example"}}), 403);
  const std::string line = client_.key() + "/line";
  EXPECT_EQ(
      client_.post_to(line, "{\"line\": \"x\"}", {{"Origin", "http://evil.example"}}, "application/json"),
      403);
  EXPECT_EQ(client_.post_to(line, "{\"line\": \"x\"}", {}, "text/plain"), 403);
  EXPECT_EQ(terminal_.str(), "ready\n") << "nothing of it was carried out";
}

TEST_F(EchoPage, KeepsTheEndOfALongDialogueAndWhatIsNoUtf8) {
  ASSERT_TRUE(client_.wait_until_ready());
  page_.words() << std::string(100000, 'a') << "\nlatin \xe4 end\n" << std::flush;
  EXPECT_EQ(client_.send("x"), 200);
  ASSERT_TRUE(client_.wait_until_ready());
  const std::string words = client_.state().at("words");
  EXPECT_LE(words.size(), 65536U + 8);
  EXPECT_THAT(words, AllOf(HasSubstr("latin "), HasSubstr("said x")));
}

// Tries workspace_survey: the page's port is taken
TEST(SurveyPages, APortThatIsTakenIsNamed) {
  std::ostringstream terminal;
  const SurveyPage first(0, terminal);
  const int port = PageClient(first.url()).port();
  EXPECT_THAT(refusal([&] { const SurveyPage second(port, terminal); }),
              AllOf(HasSubstr("--serve"), HasSubstr(std::to_string(port))));
}

// The whole way: a head is steered over HTTP until a part is found.
class SteeredByPage : public AssistHead {};

TEST_F(SteeredByPage, AHeadIsSteeredUntilAPoseIsFound) {
  mount(2);
  std::ostringstream terminal;
  SurveyPage page(0, terminal);
  AssistSetup setup = this->setup();
  setup.on_prompt = [&](const AssistView& view) { page.show(view); };
  std::thread assistant(
      [&] { exit_code_ = assist(config_, shipped_library(), setup, page.lines(), page.words()); });
  PageClient client(page.url());
  std::map<std::uint32_t, std::size_t> names;
  std::string typed;
  for (const survey::VisibleFace& face : faces()) typed += person().face_lines(face, names);
  std::istringstream lines(typed);
  for (std::string line; std::getline(lines, line);) {
    ASSERT_TRUE(client.wait_until_ready());
    ASSERT_EQ(client.send(line), 200) << line;
  }
  ASSERT_TRUE(client.wait_until_ready());
  const json state = client.state();
  EXPECT_TRUE(state.at("fitted").get<bool>()) << state.at("words");
  EXPECT_EQ(state.at("part"), "v_groove_block");
  EXPECT_GT(state.at("edges").size(), 12U);
  ASSERT_FALSE(state.at("pointing").is_null());
  // Each measured corner is shown where the part has one: 12 mm at 3.5 m.
  ASSERT_EQ(state.at("nodes").size(), names.size());
  for (const json& node : state.at("nodes")) {
    double nearest_deg = 180.0;
    for (const json& edge : state.at("edges")) {
      for (const json& end : edge) {
        const double off_pan = end.at("pan_deg").get<double>() - node.at("pan_deg").get<double>(),
                     off_tilt = end.at("tilt_deg").get<double>() - node.at("tilt_deg").get<double>();
        nearest_deg = std::min(nearest_deg, std::hypot(off_pan, off_tilt));
      }
    }
    EXPECT_LT(nearest_deg, 0.2) << node;
    EXPECT_GT(node.at("sigma_mm").get<double>(), 0.1);
    EXPECT_LT(node.at("sigma_mm").get<double>(), 20.0);
  }
  EXPECT_EQ(client.send("quit"), 200);
  assistant.join();
  EXPECT_EQ(exit_code_, 0);
}

}  // namespace
}  // namespace phantom::workspace_survey
