#include "common/teleop/coupling/servo_side.hpp"

#include <gtest/gtest.h>

#include "common/teleop/tests/stop_store.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

TEST(StopExchange, SR03_KeepsAStopAndAnswersTheResetOnce) {
  teleop::StopRequests requests;
  MemoryStopStore store;
  StopExchange exchange(requests, store);
  SideInputs in;
  requests.stop();
  const std::uint32_t asked = requests.reset({.own = 7, .partner = 8});
  {
    const test::HeapGuard guard;
    EXPECT_EQ(exchange.begin(in, 2), 1U);
    EXPECT_EQ(in.stop_requests, 3U) << "with those of signals";
    ASSERT_NE(in.reset, nullptr);
    EXPECT_EQ(in.reset->own, 7U);
    EXPECT_FALSE(exchange.end(in, {.stop = {9, StopCause::kEmergency}, .reset = ResetOutcome::kRefused}));
  }
  EXPECT_EQ(store.record, (StopRecord{9, StopCause::kEmergency}));
  EXPECT_EQ(in.reset, nullptr) << "the next step has none";
  teleop::StopRequests::Result result;
  ASSERT_TRUE(requests.take_result(result));
  EXPECT_EQ(result.number, asked);
  EXPECT_FALSE(result.released);
  EXPECT_TRUE(exchange.end(in, {.reset = ResetOutcome::kReleased}));
  EXPECT_EQ(store.record, StopRecord{});
  EXPECT_FALSE(requests.take_result(result)) << "nobody asked again";
}

TEST(StepsOfTick, MissedPeriodsAreMadeUpForUpToABound) {
  const auto one_by_one = [](double dt_s) { return steps_of_tick(dt_s, 0.001, true); };
  EXPECT_EQ(one_by_one(0.001).count, 1);
  EXPECT_EQ(one_by_one(0.003).count, 3);
  EXPECT_DOUBLE_EQ(one_by_one(0.003).step_s, 0.001);
  EXPECT_EQ(one_by_one(1.0).count, kMaxMadeUp);
  EXPECT_EQ(one_by_one(0.0).count, 1);
  const TickSteps at_once = steps_of_tick(0.003, 0.001, false);
  EXPECT_EQ(at_once.count, 1);
  EXPECT_DOUBLE_EQ(at_once.step_s, 0.003);
}

TEST(AgePartner, CountsFromWhatCameAndWhatItAnswers) {
  struct {
    core::Nanoseconds received_ns = 0, answers_ns = 0;
  } partner;
  SideInputs in;
  age_partner(in, partner, 5'000'000);
  EXPECT_EQ(in.partner_age_s, std::numeric_limits<double>::infinity());
  EXPECT_EQ(in.partner_round_trip_s, 0.0);
  partner = {4'000'000, 3'000'000};
  age_partner(in, partner, 5'000'000);
  EXPECT_DOUBLE_EQ(in.partner_age_s, 0.001);
  EXPECT_DOUBLE_EQ(in.partner_round_trip_s, 0.002);
  partner.answers_ns = 0;
  age_partner(in, partner, 5'000'000);
  EXPECT_EQ(in.partner_round_trip_s, 0.0) << "another session of ours";
}

}  // namespace
}  // namespace phantom::teleop
