#include "components/dds_spy/reading_plan.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "components/dds_spy/foreign_topics.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::EndpointInfo;

EndpointInfo writer() {
  EndpointInfo info;
  info.writer = true;
  info.type = "T";
  info.qos.reliability = diagnostics::Reliability::kReliable;
  info.qos.durability = diagnostics::Durability::kTransientLocal;
  info.qos.liveliness = diagnostics::Liveliness::kManualByTopic;
  info.qos.lease_ns = 200;
  return info;
}

bool is_reliable(const ReadingPlan& plan) {
  return plan.qos.reliability == diagnostics::Reliability::kReliable;
}
bool is_durable(const ReadingPlan& plan) {
  return plan.qos.durability == diagnostics::Durability::kTransientLocal;
}

TEST(ForeignTopicsOf, SoManyAreReadAndThoseThatNobodyWritesMakeRoom) {
  ForeignTopics topics;
  std::set<std::string> written;
  std::vector<std::string> dropped;
  const auto admit = [&](const std::string& topic) {
    written.insert(topic);
    return topics.admit(
        topic, [&](const std::string& known) { return written.contains(known); },
        [&](const std::string& known) { dropped.push_back(known); });
  };
  for (std::size_t i = 0; i < ForeignTopics::kMax; ++i) EXPECT_TRUE(admit("t" + std::to_string(i)));
  EXPECT_EQ(topics.take_problem(), "");
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(admit("further_" + std::to_string(i)));
  EXPECT_TRUE(admit("t7")) << "one that is read stays so";
  EXPECT_EQ(topics.size(), ForeignTopics::kMax);
  EXPECT_NE(topics.take_problem(), "");
  EXPECT_EQ(topics.take_problem(), "") << "told once";
  written.erase("t3");
  written.erase("t200");
  EXPECT_TRUE(admit("further_0"));
  EXPECT_EQ(dropped, (std::vector<std::string>{"t200", "t3"}));
  EXPECT_EQ(topics.size(), ForeignTopics::kMax - 1);
}

TEST(ReadingPlan, NobodyWaitsForTheSpyUnlessAsked) {
  const EndpointInfo one = writer();
  const auto plan = plan_reading({&one}, {});
  ASSERT_TRUE(plan);
  EXPECT_FALSE(is_reliable(*plan));
  EXPECT_FALSE(is_durable(*plan));
  EXPECT_EQ(plan->qos.lease_ns, 200) << "so that a loss of liveliness is reported";
  EXPECT_FALSE(plan_reading({}, {}));
}

TEST(ReadingPlan, HistoryIsAskedForWhereAllOfferIt) {
  const EndpointInfo one = writer();
  EXPECT_TRUE(is_durable(*plan_reading({&one}, {.history = true})));
  EXPECT_TRUE(is_reliable(*plan_reading({&one}, {.reliable = true})));
  EndpointInfo other = writer();
  other.qos.reliability = diagnostics::Reliability::kBestEffort;
  other.qos.durability = diagnostics::Durability::kVolatile;
  const auto plan = plan_reading({&one, &other}, {.reliable = true, .history = true});
  EXPECT_FALSE(is_reliable(*plan));
  EXPECT_FALSE(is_durable(*plan));
}

TEST(ReadingPlan, EveryWriterMatchesItsReader) {
  std::vector<EndpointInfo> all(4, writer());
  all[1].qos = {};
  all[2].qos.liveliness = diagnostics::Liveliness::kManualByParticipant;
  all[2].qos.lease_ns = 500;
  all[3].qos.durability = diagnostics::Durability::kVolatile;
  for (unsigned chosen = 1; chosen < 16; ++chosen) {
    std::vector<const EndpointInfo*> writers;
    for (unsigned i = 0; i < 4; ++i) {
      if ((chosen >> i & 1U) != 0) writers.push_back(&all[i]);
    }
    const auto plan = plan_reading(writers, {.reliable = true, .history = true});
    for (const auto* one : writers)
      EXPECT_TRUE(diagnostics::mismatches(one->qos, plan->qos).empty()) << chosen;
  }
}

// Tries dds_spy: with different types
TEST(ReadingPlan, AWriterOfAnotherTypeDoesNotWeakenIt) {
  const EndpointInfo one = writer();
  EndpointInfo other = writer();
  other.type = "U";
  other.qos = {};
  const auto plan = plan_reading({&one, &other}, {.history = true});
  EXPECT_EQ(plan->type, "T");
  EXPECT_TRUE(is_durable(*plan));
}

}  // namespace
}  // namespace phantom::dds_spy
