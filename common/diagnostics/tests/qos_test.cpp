#include "common/diagnostics/qos.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace phantom::diagnostics {
namespace {

constexpr std::int64_t kMs = 1'000'000;

struct Case {
  const char* name;
  std::function<void(EndpointQos& offered, EndpointQos& requested)> make;
  const char* policy;  ///< of the one mismatch; empty: they match
  const char* offered = "";
  const char* requested = "";
};

class Mismatches : public testing::TestWithParam<Case> {};

TEST_P(Mismatches, AreFoundAndSaidInWords) {
  EndpointQos offered, requested;
  GetParam().make(offered, requested);
  const auto found = mismatches(offered, requested);
  if (std::string(GetParam().policy).empty()) {
    EXPECT_TRUE(found.empty()) << found.front().policy;
    return;
  }
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].policy, GetParam().policy);
  EXPECT_EQ(found[0].offered, GetParam().offered);
  EXPECT_EQ(found[0].requested, GetParam().requested);
  EXPECT_FALSE(found[0].rule.empty());
  EXPECT_FALSE(found[0].advice.empty());
}

// Table of DDS 1.4, 2.2.3: each policy with a pair that fits and one that does not.
INSTANTIATE_TEST_SUITE_P(
    Policies, Mismatches,
    testing::Values(
        Case{"defaults", [](auto&, auto&) {}, ""},
        Case{"reliability", [](auto&, auto& r) { r.reliability = Reliability::kReliable; }, "reliability",
             "best effort", "reliable"},
        Case{"reliability_more", [](auto& o, auto&) { o.reliability = Reliability::kReliable; }, ""},
        Case{"durability", [](auto&, auto& r) { r.durability = Durability::kTransientLocal; }, "durability",
             "volatile", "transient local"},
        Case{"durability_more",
             [](auto& o, auto& r) {
               o.durability = Durability::kPersistent, r.durability = Durability::kTransient;
             },
             ""},
        Case{"deadline_none", [](auto&, auto& r) { r.deadline_ns = 20 * kMs; }, "deadline", "none", "20 ms"},
        Case{"deadline_longer",
             [](auto& o, auto& r) { o.deadline_ns = 1500 * kMs, r.deadline_ns = 20 * kMs; }, "deadline",
             "1.5 s", "20 ms"},
        Case{"deadline_same", [](auto& o, auto& r) { o.deadline_ns = r.deadline_ns = 20 * kMs; }, ""},
        Case{"latency_budget", [](auto& o, auto&) { o.latency_budget_ns = 5 * kMs; }, "latency budget",
             "5 ms", "0 ms"},
        Case{"liveliness_kind",
             [](auto& o, auto& r) {
               o.lease_ns = 100 * kMs, r.liveliness = Liveliness::kManualByTopic, r.lease_ns = 200 * kMs;
             },
             "liveliness", "automatic, lease 100 ms", "manual by topic, lease 200 ms"},
        Case{"liveliness_lease", [](auto& o, auto& r) { o.lease_ns = 300 * kMs, r.lease_ns = 200 * kMs; },
             "liveliness", "automatic, lease 300 ms", "automatic, lease 200 ms"},
        Case{"liveliness_more",
             [](auto& o, auto&) { o.liveliness = Liveliness::kManualByTopic, o.lease_ns = 1 * kMs; }, ""},
        Case{"ownership", [](auto& o, auto&) { o.ownership = Ownership::kExclusive; }, "ownership",
             "exclusive", "shared"},
        Case{"order", [](auto&, auto& r) { r.destination_order = DestinationOrder::kBySource; },
             "destination order", "by reception timestamp", "by source timestamp"},
        Case{"presentation",
             [](auto&, auto& r) { r.access_scope = AccessScope::kTopic, r.ordered_access = true; },
             "presentation", "instance", "topic, ordered"},
        Case{"partition", [](auto& o, auto& r) { o.partitions = {"cell_1"}, r.partitions = {"cell_2"}; },
             "partition", "'cell_1'", "'cell_2'"},
        Case{"partition_default", [](auto& o, auto&) { o.partitions = {"cell_1"}; }, "partition", "'cell_1'",
             "default"},
        Case{"partition_pattern",
             [](auto& o, auto& r) {
               o.partitions = {"cell_1"}, r.partitions = {"", "cell_*"};
             },
             ""},
        Case{"representation", [](auto& o, auto&) { o.representations = {Representation::kXcdr2}; },
             "data representation", "XCDR2", "XCDR1"},
        Case{"representation_read",
             [](auto& o, auto& r) {
               o.representations = {Representation::kXcdr2},
               r.representations = {Representation::kXcdr1, Representation::kXcdr2};
             },
             ""}),
    [](const auto& tested) { return tested.param.name; });

TEST(Mismatch, SeveralReasonsAreAllTold) {
  EndpointQos requested;
  requested.reliability = Reliability::kReliable;
  requested.durability = Durability::kTransientLocal;
  requested.deadline_ns = kMs;
  EXPECT_EQ(mismatches({}, requested).size(), 3u);
}

TEST(Mismatch, TheAdviceNamesTheValueThatWouldFit) {
  EndpointQos requested;
  requested.deadline_ns = 20 * kMs;
  EXPECT_EQ(mismatches({}, requested).front().advice,
            "give the writer a deadline of at most 20 ms (and keep it), or the reader none");
}

TEST(QosText, SaysWhatDepartsFromTheDefault) {
  EndpointQos qos;
  EXPECT_EQ(qos_text(qos), "best effort, volatile");
  qos.deadline_ns = 20 * kMs;
  qos.liveliness = Liveliness::kManualByTopic;
  qos.lease_ns = 200 * kMs;
  qos.lifespan_ns = 1000 * kMs;
  qos.partitions = {"", "b"};
  EXPECT_EQ(qos_text(qos),
            "best effort, volatile, deadline 20 ms, liveliness manual by topic, lease 200 ms, "
            "lifespan 1 s, partition default, 'b'");
}

TEST(DurationText, UsesTheUnitThatReadsBest) {
  EXPECT_EQ(duration_text(kInfinite_ns), "none");
  EXPECT_EQ(duration_text(0), "0 ms");
  EXPECT_EQ(duration_text(250'000), "250 µs");
  EXPECT_EQ(duration_text(20 * kMs), "20 ms");
  EXPECT_EQ(duration_text(1500 * kMs), "1.5 s");
}

}  // namespace
}  // namespace phantom::diagnostics
