#include "components/dds_spy/events.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "components/dds_spy/status_watch.hpp"

namespace phantom::dds_spy {
namespace {

Event gap(core::Nanoseconds utc_ns, const std::string& text, const std::string& topic = "t") {
  return {.utc_ns = utc_ns, .kind = EventKind::kGap, .topic = topic, .who = "w", .text = text};
}

struct EventLogTest : testing::Test {
  std::vector<Event> reported;
  EventLog log{3, 1.0, [this](const Event& event) { reported.push_back(event); }};
};

TEST_F(EventLogTest, TheFirstIsToldAtOnceTheNextOnesTogether) {
  for (int i = 0; i < 10; ++i) log.add(gap((10 + i) * core::kNsPerMillisecond, std::to_string(i)));
  log.add(gap(30 * core::kNsPerMillisecond, "other", "u"));
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_EQ(reported[0].text, "0");
  log.look(500 * core::kNsPerMillisecond);
  EXPECT_EQ(reported.size(), 2u) << "not yet quiet for long enough";
  log.look(1100 * core::kNsPerMillisecond);
  ASSERT_EQ(reported.size(), 3u);
  EXPECT_EQ(reported[2].text, "9");
  EXPECT_EQ(reported[2].count, 9u);
  EXPECT_EQ(log.totals().at(EventKind::kGap), 11u);
}

TEST_F(EventLogTest, NothingIsLostAtTheEnd) {
  log.add(gap(10 * core::kNsPerMillisecond, "a"));
  log.add(gap(11 * core::kNsPerMillisecond, "b"));
  log.flush();
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_EQ(reported[1].text, "b");
  log.flush();
  EXPECT_EQ(reported.size(), 2u);
}

TEST_F(EventLogTest, AfterAQuietTimeTheNextIsToldAtOnceAgain) {
  log.add(gap(10 * core::kNsPerMillisecond, "a"));
  log.look(2000 * core::kNsPerMillisecond);
  log.add(gap(2001 * core::kNsPerMillisecond, "b"));
  EXPECT_EQ(reported.size(), 2u);
}

TEST_F(EventLogTest, OnlyTheNewestAreKept) {
  for (int i = 0; i < 5; ++i) log.add(gap(i * 2000 * core::kNsPerMillisecond, std::to_string(i)));
  ASSERT_EQ(log.newest().size(), 3u);
  EXPECT_EQ(log.newest().front().text, "2");
}

TEST_F(EventLogTest, SoManyAreHeldBackTheLongestHeldGoesOutEarly) {
  for (std::size_t i = 0; i < 3 * EventLog::kMaxHeld; ++i) {
    const std::string topic = "t" + std::to_string(i);
    log.add(gap(static_cast<core::Nanoseconds>(1 + i), "first", topic));
    log.add(gap(static_cast<core::Nanoseconds>(1 + i), "second", topic));
  }
  EXPECT_EQ(log.held(), EventLog::kMaxHeld);
  log.flush();
  EXPECT_EQ(reported.size(), 6 * EventLog::kMaxHeld) << "none is lost";
}

TEST(Event, EveryKindHasItsOwnName) {
  const auto names = event_kind_names();
  EXPECT_EQ(names.size(), static_cast<std::size_t>(EventKind::kComponentCounter) + 1);
  EXPECT_EQ(std::string(name_of(EventKind::kQosMismatch)), "qos_mismatch");
  EXPECT_EQ(std::string(name_of(EventKind::kComponentCounter)), "component_counter");
}

nlohmann::ordered_json status(const std::string& state, int deadline_missed) {
  return {{"component_name", "master_io"},
          {"host", "desk"},
          {"state", state},
          {"message", ""},
          {"figures", nlohmann::ordered_json::array()},
          {"topics",
           {{{"topic", "drag_field"},
             {"writer", false},
             {"deadline_missed", deadline_missed},
             {"liveliness_lost", 0},
             {"incompatible_qos", 0},
             {"refused", 0}}}}};
}

TEST(StatusWatch, TellsChangesOfStateAndRisingCounters) {
  StatusWatch watch;
  ASSERT_EQ(watch.take(status("COMPONENT_RUNNING", 5)).size(), 1u)
      << "counts before the first look are not news";
  EXPECT_TRUE(watch.take(status("COMPONENT_RUNNING", 5)).empty());
  const auto events = watch.take(status("COMPONENT_DEGRADED", 8));
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::kComponentState);
  EXPECT_EQ(events[0].text, "COMPONENT_RUNNING → COMPONENT_DEGRADED");
  EXPECT_EQ(events[1].topic, "drag_field");
  EXPECT_EQ(events[1].text, "its reader's deadline_missed rose by 3 to 8");
}

TEST(StatusWatch, ARestartedComponentCountsFromZeroWithoutNews) {
  StatusWatch watch;
  watch.take(status("COMPONENT_RUNNING", 8));
  EXPECT_TRUE(watch.take(status("COMPONENT_RUNNING", 0)).empty());
  EXPECT_EQ(watch.take(status("COMPONENT_RUNNING", 1)).size(), 1u);
}

TEST(StatusWatch, ReportsDatagramsThatAComponentRefused) {
  StatusWatch watch;
  const auto refused = [](const char* reason, int count) {
    auto one = status("COMPONENT_RUNNING", 0);
    one["figures"] = {{{"name", "rate"}, {"value", 3.0}, {"unit", "Hz"}},
                      {{"name", reason}, {"value", count}, {"unit", "datagrams"}}};
    return one;
  };
  EXPECT_EQ(watch.take(refused("refused: no header of RTPS 2", 7)).size(), 1u) << "only its state is news";
  const auto more = watch.take(refused("refused: no header of RTPS 2", 9));
  ASSERT_EQ(more.size(), 1u);
  EXPECT_EQ(more[0].kind, EventKind::kComponentCounter);
  EXPECT_EQ(more[0].text, "it refused 2 datagrams: no header of RTPS 2 (9 so far)");
  const auto other = watch.take(refused("refused: too many participants", 1));
  ASSERT_EQ(other.size(), 1u) << "a reason that was not there before";
}

TEST(StatusWatch, ReportsWhoSentMostOfWhatWasRefused) {
  StatusWatch watch;
  auto one = status("COMPONENT_RUNNING", 0);
  watch.take(one);
  one["figures"] = {{{"name", "refused: too many participants"}, {"value", 9.0}, {"unit", "datagrams"}},
                    {{"name", "refused from: no header of RTPS 2"}, {"value", 3.0}, {"unit", "10.0.0.9"}},
                    {{"name", "refused from: too many participants"}, {"value", 7.0}, {"unit", "10.30.1.2"}}};
  const auto events = watch.take(one);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].text,
            "it refused 9 datagrams: too many participants (9 so far, 7 of them from 10.30.1.2)");
}

TEST(StatusWatch, AnotherTypeOfThatNameIsNoFault) {
  StatusWatch watch;
  EXPECT_TRUE(watch.take({{"component_name", 3}}).empty());
}

}  // namespace
}  // namespace phantom::dds_spy
