// The files of texts: complete in each language, each text used, and no sentence beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "common/messages/living.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "components/synthetic_viewer/state/delay_stages.hpp"
#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/stream/headset_hand.hpp"

namespace phantom::synthetic_viewer::texts_test {
namespace {

using Texts = std::map<std::string, std::string>;

const std::filesystem::path kRoom = PHANTOM_SOURCE_DIR "/components/synthetic_viewer";

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Texts texts(const std::string& language) {
  return nlohmann::json::parse(content(kRoom / "web" / ("texts." + language + ".json"))).get<Texts>();
}

std::multiset<std::string> matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::multiset<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match)
    found.insert((*match)[match->size() - 1].str());
  return found;
}

/// Everything that may name a text: the page's files and the viewer's sources that know LocalizedText.
std::string users() {
  std::string all;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kRoom)) {
    const std::string kind = entry.path().extension(), path = entry.path().string();
    if ((kind != ".html" && kind != ".js" && kind != ".cpp") || path.find("/tests/") != std::string::npos)
      continue;
    const std::string text = content(entry.path());
    if (kind != ".cpp" || text.find("LocalizedText") != std::string::npos) all += text;
  }
  return all;
}

TEST(PageTexts, LiveMatterHasItsNameBeforeItsMarkerComesAndAfterItHasGone) {
  ViewerState state;
  EXPECT_EQ(object_name(state, messages::kLiveId, Language::kEnglish), "live matter");
  EXPECT_EQ(object_name(state, messages::kLiveId, Language::kGerman), "nicht modelliertes Ding");
  EXPECT_EQ(object_name(state, 7, Language::kEnglish), "object 7");
  ObjectSample named;  // a cell without live matter may give that number to an object
  EXPECT_EQ(object_name(state, messages::kFirstLiveObjectId + 2, Language::kEnglish), "live object 3");
  EXPECT_EQ(object_name(state, messages::kFirstLiveObjectId, Language::kGerman), "nicht modelliertes Ding 1");
  named.id = messages::kLiveId;
  named.name = "vice";
  named.mesh_hash = 1;
  state.take(named, 1);
  EXPECT_EQ(object_name(state, messages::kLiveId, Language::kEnglish), "vice");
}

TEST(PageTexts, EveryLanguageHasEveryTextWithTheSamePlaces) {
  const Texts english = texts("en"), german = texts("de");
  ASSERT_GT(english.size(), 200U);
  for (const auto& [key, text] : english) {
    ASSERT_TRUE(german.contains(key)) << key;
    EXPECT_FALSE(german.at(key).empty()) << key;
    const std::string places = R"((\{[^}]*\}))";
    EXPECT_EQ(matches(text, places), matches(german.at(key), places)) << key;
    EXPECT_EQ((text + german.at(key)).find('<'), std::string::npos)
        << key << ": the page brings them as data";
  }
  EXPECT_EQ(german.size(), english.size());
}

TEST(PageTexts, EveryTextIsUsedAndEveryUsedTextIsThere) {
  const std::string all = users();
  const Texts english = texts("en");
  const auto names = matches(all, R"([\"'`]([a-z_]+\.[A-Za-z0-9_]*)[\"'`])");
  std::set<std::string> groups;  // "state." + something
  for (const std::string& name : names)
    if (name.ends_with('.')) groups.insert(name);
  for (const std::string& group : matches(all, R"(data-options=\"([a-z_]+)\")")) groups.insert(group + ".");
  for (const auto& [key, text] : english) {
    const std::string group = key.substr(0, key.find('.') + 1);
    const bool silent = key.ends_with("_silent") && names.contains(key.substr(0, key.size() - 7));
    EXPECT_TRUE(names.contains(key) || groups.contains(group) || silent) << key << " is used nowhere";
  }
  std::set<std::string> known;  // groups of texts
  for (const auto& [key, text] : english) known.insert(key.substr(0, key.find('.')));
  const std::set<std::string> files{"hits.jpg",     "page.css",   "page.js",    "stop.js",   "views.js",
                                    "choice.js",    "session.js", "scene.js",   "review.js", "review.css",
                                    "calibrate.js", "layout.js",  "layout.css", "tour.js"};
  for (const std::string& name : names) {
    const std::string group = name.substr(0, name.find('.'));
    if (name.ends_with('.') || !known.contains(group) || files.contains(name)) continue;
    EXPECT_TRUE(english.contains(name)) << name << " is missing";
  }
}

TEST(PageTexts, EveryNameOfAStateHasAText) {
  const Texts english = texts("en");
  for (int i = 0; i < 6; ++i)
    for (const char* group : {"link_state.", "link_tip."})
      EXPECT_TRUE(english.contains(group + label_of(static_cast<LinkState>(i)))) << group << i;
  for (int i = 0; i < 6; ++i)
    EXPECT_TRUE(
        english.contains(std::string("component_state.") + label_of(static_cast<core::ComponentState>(i))))
        << i;
  for (int i = 0; i < 4; ++i) {
    for (const char* group : {"motion.", "motion_tip."})
      EXPECT_TRUE(english.contains(group + std::string(name_of(static_cast<MotionClass>(i))))) << group << i;
    EXPECT_TRUE(english.contains(std::string("rule.") + name_of(static_cast<HitRule>(i)))) << i;
  }
  for (int i = 0; i <= static_cast<int>(HandWord::kEnd); ++i)
    EXPECT_TRUE(english.contains(std::string("hand.") + name_of(static_cast<HandWord>(i)))) << i;
  for (const DelayStage& stage : delay_stages({}, {}, 0))
    for (const char* group : {"delay.", "delay_tip."})
      EXPECT_TRUE(english.contains(group + std::string(stage.name))) << group << stage.name;
}

TEST(PageTexts, ThePageItselfHoldsNoSentence) {
  const std::string html =
      std::regex_replace(content(kRoom / "web/index.html"), std::regex("\\{texts\\}"), "");
  EXPECT_EQ(matches(html, R"( (title|aria-label|alt|placeholder)=\")"), std::multiset<std::string>());
  for (const std::string& between : matches(html, ">([^<>]*[A-Za-z][A-Za-z]+[^<>]*)<"))
    EXPECT_THAT(between, testing::AnyOf("Phantom ", "N S E W T B"));
  for (const auto& entry : std::filesystem::directory_iterator(kRoom / "web")) {
    if (entry.path().extension() != ".js") continue;
    const std::string code = std::regex_replace(content(entry.path()), std::regex("//[^\n]*"), "");
    for (const std::string& literal : matches(code, "['`]([A-Z]?[a-z]+,? [a-z]+ [a-z][^'`\n]*)['`]"))
      ADD_FAILURE() << entry.path().filename() << ": " << literal;
  }
}

TEST(PageTexts, TheRowsOfTheTableAreThoseOfTheLaw) {
  using enum teleop::BilateralLaw;
  using teleop::Counterbalance;
  ViewerState state;
  for (const auto law : {kPf, kSctfb, kPfff, kPe, kPeff}) {
    for (const auto balance :
         {Counterbalance::kNone, Counterbalance::kMechanical, Counterbalance::kAutomatic}) {
      for (int chosen = 0; chosen < 8; ++chosen) {
        state.master.law = law;
        state.arm.counterbalance = balance;
        const teleop::PerceptChoice choice = teleop::percepts_of(chosen, law);
        state.master.percept_enabled = choice.drag;
        state.master.tone_enabled = choice.tone;
        state.master.views_enabled = choice.views;
        // The row's letter as the console has it, and what is chosen.
        const std::string row = teleop::percept_set(law, balance).row, letter = row.substr(0, row.find(':'));
        EXPECT_THAT(english_text(percepts_words(state)),
                    testing::EndsWith("(" + letter + "): " + teleop::words_of(choice)));
      }
    }
  }
}

TEST(PageTexts, AWordThatIsFilledInIsNoPattern) {
  EXPECT_EQ(english_text({"stop_side.refused", {{"message", "{0} {x:.1f} }{"}}}),
            "REFUSED THE STOP: {0} {x:.1f} }{");
  EXPECT_EQ(english_text({}), "");
  EXPECT_EQ(english_text({"no_such.text", {}}), "no_such.text");
}

}  // namespace
}  // namespace phantom::synthetic_viewer::texts_test
