#include "components/phantom_sensing/alert_relay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <utility>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

/// A topic whose reader just joins: the first alert is held up until the test lets it go.
struct HeldUp : PerceptSink {
  std::promise<void> entered, let_go;
  std::vector<std::pair<std::uint32_t, bool>> alerts;
  std::size_t drags = 0, percepts = 0;
  void on_drag(const StepOutputs&, const TickInfo&) override { ++drags; }
  void on_percept(const StepOutputs&, const TickInfo&) override { ++percepts; }
  void on_alert(const percept::Alert& alert, bool cleared) override {
    if (alerts.empty()) {
      entered.set_value();
      let_go.get_future().wait();
    }
    alerts.emplace_back(alert.number, cleared);
  }
};

percept::Alert alert(std::uint32_t number) {
  percept::Alert made;
  made.number = number;
  return made;
}

TEST(AlertRelay, ATickGoesOnWhileAnAlertIsHeldUpAndNoneIsLostOrOutOfOrder) {
  HeldUp sink;
  AlertRelay relay(sink);
  const StepOutputs outputs;
  const TickInfo info;
  relay.on_alert(alert(1), false);
  sink.entered.get_future().wait();
  {
    const test::HeapGuard no_heap;
    relay.on_drag(outputs, info);
    relay.on_percept(outputs, info);
    relay.on_alert(alert(1), true);
    relay.on_alert(alert(2), false);
    relay.on_drag(outputs, info);
  }
  EXPECT_EQ(sink.drags, 2U);
  EXPECT_EQ(sink.percepts, 1U);
  sink.let_go.set_value();
  relay.end();
  EXPECT_THAT(sink.alerts,
              testing::ElementsAre(std::pair(1U, false), std::pair(1U, true), std::pair(2U, false)));
  EXPECT_EQ(relay.left_out(), 0U);
}

TEST(AlertRelay, WhatFindsNoRoomIsCountedAndTheRestComes) {
  HeldUp sink;
  AlertRelay relay(sink);
  relay.on_alert(alert(0), false);
  sink.entered.get_future().wait();
  for (std::uint32_t i = 1; i <= AlertRelay::kMaxWaiting + 3; ++i) relay.on_alert(alert(i), false);
  EXPECT_EQ(relay.left_out(), 3U);
  sink.let_go.set_value();
  relay.end();
  ASSERT_EQ(sink.alerts.size(), AlertRelay::kMaxWaiting + 1);
  EXPECT_EQ(sink.alerts.back().first, AlertRelay::kMaxWaiting);
}

}  // namespace
}  // namespace phantom::phantom_sensing
