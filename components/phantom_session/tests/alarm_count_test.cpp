#include "components/phantom_session/alarm_count.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace phantom::phantom_session {
namespace {

percept::HitRule rule_of(const std::string& name) {
  return name == "very_close"        ? percept::HitRule::kVeryClose
         : name == "moderate_moving" ? percept::HitRule::kModerateMoving
                                     : percept::HitRule::kFarNearing;
}
double contact_of(const nlohmann::json& contact) { return contact.is_null() ? -1.0 : contact.get<double>(); }

// Tries the sequences that the page's own list is tried with.
TEST(AlarmCount, CountsWhatThePageLists) {
  std::ifstream file(PHANTOM_SOURCE_DIR "/components/synthetic_viewer/web/tests/alarm_cases.json");
  const auto all = nlohmann::json::parse(file);
  ASSERT_GE(all["cases"].size(), 4U);
  for (const auto& one : all["cases"]) {
    AlarmCount count;
    std::size_t begun = 0;
    for (const auto& step : one["steps"]) {
      const double t_s = step["t_s"];
      for (const auto& hit : step.value("raised", nlohmann::json::array()))
        begun += count.on_raised(t_s, hit[0], hit[1], AlarmCount::asks(rule_of(hit[2]), contact_of(hit[3])));
      for (const auto& alert : step.value("cleared", nlohmann::json::array())) count.on_cleared(t_s, alert);
      std::vector<messages::Threat> threats;
      for (const auto& each : step.value("threats", nlohmann::json::array())) {
        messages::Threat threat;
        threat.object = each[0];
        threat.rule = rule_of(each[1]);
        threat.contact.time_s = contact_of(each[2]);
        threats.push_back(threat);
      }
      begun += count.on_threats(t_s, threats);
      EXPECT_EQ(count.entries(), step["entries"].get<std::size_t>()) << one["name"] << " at " << t_s;
      EXPECT_EQ(begun, count.entries());
    }
  }
}

TEST(AlarmCount, IsBoundedWhateverComes) {
  AlarmCount count;
  for (std::uint32_t alert = 1; alert < 3 * AlarmCount::kMaxStanding; ++alert)
    count.on_raised(20.0, alert, static_cast<int>(alert), true);
  EXPECT_EQ(count.entries(), 1U) << "one motion";
  EXPECT_EQ(count.on_raised(22.0, 999999, 7, true), 0U);
  for (std::uint32_t alert = 1; alert < 3 * AlarmCount::kMaxStanding; ++alert) count.on_cleared(22.0, alert);
  count.on_cleared(22.0, 1);
  EXPECT_EQ(count.on_raised(30.0, 7, 999999, true), 1U) << "another motion";
}

}  // namespace
}  // namespace phantom::phantom_session
