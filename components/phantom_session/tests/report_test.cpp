#include "components/phantom_session/report.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "common/teleop/rendering/percept_set.hpp"
#include "components/phantom_session/report_page.hpp"
#include "tests/support/files.hpp"

namespace phantom::phantom_session {
namespace {

class Report : public testing::Test {
 protected:
  void leave(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  nlohmann::json summary() {
    return nlohmann::json::parse(summary_json(
        {folder_, 30.0, 1'000'000'000, "http://127.0.0.1:8080/", {{"slave_io", 0, true}}, collector_}));
  }
  void sense(bool valid) {
    messages::Percept felt;
    felt.valid = valid;
    collector_.on_percept(t_s_, felt);
  }
  void reach(int number, bool percept, double speed_m_s, int object = 1) {
    messages::SlaveState slave;
    slave.tool_speed_m_s = speed_m_s;
    slave.clearance_m = 0.05;
    collector_.on_slave(t_s_ += 1, slave);
    messages::MasterState master;
    master.reach = number;
    master.percept_enabled = percept;
    master.percept_torque_Nm[0] = percept ? 0.7 : 0.0;
    collector_.on_master(t_s_, master);
    slave = {};
    slave.contact = true;
    slave.contact_object = static_cast<std::uint16_t>(object);
    slave.clearance_m = 0.0;
    collector_.on_slave(t_s_ += 1, slave);
  }

  const std::filesystem::path folder_ = test::new_folder();
  Collector collector_{0.05, 0.01, {}};
  double t_s_ = 0.0;
};

// A percept that is on, while phantom_sensing has none to give, says nothing of what it does.
TEST_F(Report, AReachBeforeAnythingIsSensedCountsAsNeither) {
  reach(0, true, 0.90);
  sense(false);
  reach(1, true, 0.80);
  sense(true);
  reach(2, true, 0.04);
  reach(3, false, 0.10);
  const auto s = summary();
  EXPECT_NEAR(s["percept"]["contact_speed_with"].get<double>(), 0.04, 1e-12);
  EXPECT_NEAR(s["percept"]["contact_speed_without"].get<double>(), 0.10, 1e-12);
  EXPECT_TRUE(s["reaches"][1]["percept_missing"].get<bool>());
  EXPECT_FALSE(s["reaches"][2]["percept_missing"].get<bool>());
}

TEST_F(Report, SummaryHoldsWhatTheComponentsLeftAndWhatWasSeen) {
  leave("master_io.json", R"({"round_trip": {"p50_us": 900, "n": 25000}})");
  leave("wva_server.json", R"({"version": 1, "bricks": 300, "bytes": 123, "build_seconds": 0.5})");
  leave("audio_percept.json", R"({"wav": "audio.wav"})");
  leave("synthetic_viewer.json",
        R"({"views": [{"t": 3, "node": "NE", "png": "hit_001.png", "utc_ns": 6000000000}]})");
  collector_.on_object_name(1, "drum");
  sense(true);
  reach(0, true, 0.04);
  reach(1, false, 0.10);
  reach(2, true, 0.06);
  collector_.on_status({.component = "slave_io",
                        .state = core::ComponentState::kRunning,
                        .loops = {{.name = "servo", .period_s = 0.001, .rate_hz = 999.0, .ticks = 5}},
                        .deadline_missed = {{"master_state", 2}}});
  collector_.on_status({.component = "viewer", .deadline_missed = {{"master_state", 1}}});
  using teleop::BilateralLaw, teleop::Counterbalance;
  collector_.on_percepts(1.0, {BilateralLaw::kSctfb, Counterbalance::kNone, {}});
  collector_.on_percepts(2.0, {BilateralLaw::kSctfb, Counterbalance::kNone, {}});
  collector_.on_percepts(3.0, {BilateralLaw::kPe, Counterbalance::kNone, {false, true, true, true}});
  const auto s = summary();
  ASSERT_EQ(s["percept_sets"].size(), 2U);
  EXPECT_EQ(s["percept_sets"][0]["set"], "b2: SCTFB, weight felt: drag, tone and views");
  EXPECT_EQ(s["percept_sets"][1]["set"], "d1: position exchange: tone and views");
  EXPECT_EQ(s["percept_sets"][1]["t"], 3.0);
  EXPECT_TRUE(s["percept_sets"][1]["automatic"]);
  EXPECT_EQ(s["round_trip"]["n"], 25000);
  EXPECT_EQ(s["workspace"]["bricks"], 300);
  EXPECT_EQ(s["audio"], "audio.wav");
  EXPECT_EQ(s["views"][0]["node"], "NE");
  EXPECT_EQ(s["views"][0]["t"], 5.0) << "on the session's scale, not the viewer's";
  EXPECT_EQ(s["components"]["slave_io"]["exit"], 0);
  EXPECT_NEAR(s["percept"]["contact_speed_with"].get<double>(), 0.05, 1e-12);
  EXPECT_NEAR(s["percept"]["contact_speed_without"].get<double>(), 0.10, 1e-12);
  EXPECT_NEAR(s["percept"]["onset_distance_m"].get<double>(), 0.05, 1e-12);
  EXPECT_EQ(s["loops"]["slave_io.servo"]["rate_hz"], 999.0);
  EXPECT_EQ(s["deadline_missed"]["master_state"], 3) << "added up over the readers";
  EXPECT_EQ(s["reaches"][1]["object"], "drum");
}

TEST_F(Report, ContactSpeedsCompareOnlyObjectsTouchedBothWays) {
  sense(true);
  reach(0, true, 0.04, 1);
  reach(1, false, 0.10, 1);
  reach(2, true, 0.90, 2);  // never reached without the percept
  const auto s = summary();
  EXPECT_NEAR(s["percept"]["contact_speed_with"].get<double>(), 0.04, 1e-12);
  EXPECT_NEAR(s["percept"]["contact_speed_without"].get<double>(), 0.10, 1e-12);
}

TEST_F(Report, TheLeadTimeIsFromTheFirstAlertOfTheObjectThatIsTouched) {
  const auto alert = [this](double before_s, int object) {
    collector_.on_hit(
        {.t_s = t_s_ + 2.0 - before_s, .alert = 1, .rule = "far", .link = "arm", .object = object});
  };
  sense(true);
  alert(0.9, 2);  // of another object
  alert(0.6, 1);
  alert(0.2, 1);
  reach(0, true, 0.04, 1);
  alert(0.2, 1);
  reach(1, false, 0.04, 1);
  reach(2, true, 0.04, 1);  // none
  const auto s = summary();
  EXPECT_NEAR(s["reaches"][0]["lead_s"].get<double>(), 0.6, 1e-9);
  EXPECT_NEAR(s["reaches"][1]["lead_s"].get<double>(), 0.2, 1e-9);
  EXPECT_TRUE(s["reaches"][2]["lead_s"].is_null());
  EXPECT_EQ(s["lead_times"]["contacts"], 3);
  EXPECT_EQ(s["lead_times"]["unannounced"], 1);
  EXPECT_NEAR(s["lead_times"]["median_s"].get<double>(), 0.4, 1e-9);
  EXPECT_NEAR(s["lead_times"]["least_s"].get<double>(), 0.2, 1e-9);
  EXPECT_NEAR(s["lead_times"]["share_in_time"].get<double>(), 1.0 / 3.0, 1e-9);
}

TEST_F(Report, WhatNobodyMeasuredIsNullNotZero) {
  leave("audio_percept.json", "{ this is not json");
  const auto s = summary();
  EXPECT_TRUE(s["round_trip"].is_null());
  EXPECT_TRUE(s["audio"].is_null());
  EXPECT_TRUE(s["workspace"]["version"].is_null());
  EXPECT_TRUE(s["percept"]["contact_speed_with"].is_null());
  for (const Language language : kLanguages) EXPECT_NO_THROW(report_page(s.dump(), language));
}

TEST_F(Report, FilesAreWrittenAndThePageEscapesNames) {
  collector_.on_object_name(1, "<drum & lid>");
  reach(0, true, 0.04);
  write_report({folder_, 1.0, 0, "", {}, collector_});
  std::ifstream page(folder_ / "index.html");
  std::ostringstream text;
  text << page.rdbuf();
  EXPECT_NE(text.str().find("&lt;drum &amp; lid&gt;"), std::string::npos);
  EXPECT_EQ(text.str().find("<drum"), std::string::npos);
  std::ifstream series(folder_ / "series.csv");
  std::string head, row;
  std::getline(series, head);
  std::getline(series, row);
  EXPECT_EQ(std::count(head.begin(), head.end(), ','), std::count(row.begin(), row.end(), ','));
}

TEST_F(Report, ThePageTellsInWordsAndUnitsWhatTheSummaryHasByKeys) {
  leave("master_io.json", R"({"round_trip": {"p50_us": 900, "p99_us": 2500, "n": 25000}})");
  leave("wva_server.json", R"({"version": 1, "bricks": 300, "bytes": 1230000, "build_seconds": 0.5})");
  leave("synthetic_viewer.json",
        R"({"views": [{"t": 3, "alert": 7, "node": "NE", "png": "hit_001.png", "utc_ns": 6000000000}]})");
  collector_.on_object_name(1, "drum");
  sense(true);
  reach(0, true, 0.04);
  reach(1, false, 0.10);
  collector_.on_status({.component = "slave_io",
                        .loops = {{.name = "servo", .period_s = 0.001, .rate_hz = 999.0, .ticks = 5}},
                        .deadline_missed = {{"master_state", 2}}});
  const std::string page = report_page(summary().dump(), Language::kEnglish);
  for (const char* words :
       {"<td>Speed at first contact with the percept (median), mm/s</td><td>40</td>",
        "<td>Median, ms</td><td>0.9</td>", "<td>99 % are below, ms</td><td>2.5</td>",
        "<td>Size, MB</td><td>1.23</td>", "<th>Process and loop</th><th>Rate of the last second, Hz</th>",
        "<td>slave_io.servo</td><td>999</td>", "<th>Deadlines missed</th>", "<td>master_state</td><td>2</td>",
        "<figcaption>Figure 1. Percept torque over",
        "Figure 5. The zone of alert 7 at 5 s, seen from node NE."})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  for (const std::string key :
       {"onset_distance", "contact_t", "_us", "_hz", "_seconds", "torque_nm", "utc_ns"})
    EXPECT_EQ(page.find(key), std::string::npos) << key;
}

TEST_F(Report, TheGermanPageSaysItInGerman) {
  collector_.on_object_name(1, "drum");
  sense(true);
  reach(0, true, 0.0415);
  reach(1, false, 0.10);
  collector_.on_percepts(1.0, {teleop::BilateralLaw::kSctfb, teleop::Counterbalance::kMechanical, {}});
  collector_.on_hit({3.0, 7, "nearing fast", "gripper", {}, 1, false});
  const std::string page = report_page(summary().dump(), Language::kGerman);
  for (const char* words :
       {"<html lang=\"de\">",
        "<td>Tempo beim ersten Kontakt mit Annäherungshilfe (Median), mm/s</td><td>41,5</td>",
        "<figcaption>Bild 1. Moment der",
        "<td>Momentenrückführung, Arm im Gleichgewicht (b1): Kraft, Ton und Bild</td>",
        "<td>nähert sich schnell</td>", "<p>nicht gemessen</p>", "<a href=\"index.html#chosen\""})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  const std::regex key(">[^<]*(_[a-z]+_|_us|_hz|_ms|torque_nm)[^<]*<");
  EXPECT_FALSE(std::regex_search(page, key));
}

TEST_F(Report, BothLanguagesHaveEveryTextAndEveryTextIsUsed) {
  const auto texts = [](const std::string& language) {
    std::ifstream file(PHANTOM_SOURCE_DIR "/components/phantom_session/texts." + language + ".json");
    return nlohmann::json::parse(file).get<std::map<std::string, std::string>>();
  };
  const auto english = texts("en"), german = texts("de");
  EXPECT_EQ(english.size(), german.size());
  std::ifstream source(PHANTOM_SOURCE_DIR "/components/phantom_session/report_page.cpp");
  const std::string code{std::istreambuf_iterator<char>(source), std::istreambuf_iterator<char>()};
  for (const auto& [key, text] : english) {
    EXPECT_TRUE(german.contains(key)) << key;
    const std::string group = key.substr(0, key.find('.')), name = key.substr(key.find('.') + 1);
    const bool translated = group == "row" || group == "chosen" || group == "rule";
    EXPECT_TRUE(
        translated || code.find('"' + key + '"') != std::string::npos ||
        (code.find('"' + group) != std::string::npos && code.find('"' + name + '"') != std::string::npos) ||
        name == "title" || name == "name")
        << key;
  }
  using enum teleop::BilateralLaw;
  for (const auto law : {kPf, kSctfb, kPfff, kPe, kPeff}) {
    for (const auto balance : {teleop::Counterbalance::kNone, teleop::Counterbalance::kMechanical,
                               teleop::Counterbalance::kAutomatic})
      EXPECT_TRUE(german.contains(std::string("row.") + teleop::percept_set(law, balance).row));
    for (int chosen = 0; chosen < 8; ++chosen)
      EXPECT_TRUE(german.contains("chosen." + teleop::words_of(teleop::percepts_of(chosen, law))));
  }
}

TEST_F(Report, AnUnwritableFolderIsSaid) {
  EXPECT_THROW(write_report({folder_ / "gone", 1.0, 0, "", {}, collector_}), std::runtime_error);
}

}  // namespace
}  // namespace phantom::phantom_session
