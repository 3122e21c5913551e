#include "common/messages/object_sources.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace phantom::messages {
namespace {

using workspace::SourceId;
constexpr SourceId kFirst{1}, kSecond{2}, kThird{3}, kFourth{4};

WorkspaceObject object(std::uint16_t id, const std::string& name, double x_m = 0.0) {
  WorkspaceObject made{.id = id, .name = name, .mesh_hash = 7};
  made.X_WO.translation_m.x() = x_m;
  return made;
}

/// What a consumer shows that makes all the changes it is told.
class Shown {
 public:
  void make(const std::vector<WorkspaceObject>& changes) {
    for (const WorkspaceObject& change : changes) {
      if (change.removed()) {
        EXPECT_EQ(names_.erase(change.id), 1U) << "only what is shown is removed";
      } else {
        names_[change.id] = change.name + "@" + std::to_string(change.X_WO.translation_m.x());
      }
    }
  }
  void expect(const ObjectSources::Objects& objects) const {
    std::map<std::uint16_t, std::string> names;
    for (const auto& [id, one] : objects)
      names[id] = one.name + "@" + std::to_string(one.X_WO.translation_m.x());
    EXPECT_EQ(names_, names);
  }

 private:
  std::map<std::uint16_t, std::string> names_;
};

TEST(ObjectSources, ASecondServersObjectsAreNotShownBesideTheFirsts) {
  ObjectSources sources;
  EXPECT_EQ(sources.take(kFirst, object(1, "vice")).changes.size(), 1U);
  EXPECT_TRUE(sources.commit(kFirst).accepted);
  const auto foreign = sources.take(kSecond, object(1, "ghost"));
  EXPECT_TRUE(foreign.accepted) << "it may be a successor";
  EXPECT_TRUE(foreign.changes.empty());
  EXPECT_FALSE(sources.commit(kSecond).accepted);
  EXPECT_EQ(sources.in_force().at(1).name, "vice");
  EXPECT_EQ(sources.of(kSecond).at(1).name, "ghost");
  EXPECT_EQ(sources.of(kThird).at(1).name, "vice") << "of one that is unknown";
}

// A server that is killed is present until its lease has run out; its successor commits before that, and
// once.
TEST(ObjectSources, WhatASuccessorCommittedMeanwhileIsInForceOnceTheServerHasGone) {
  ObjectSources sources;
  const auto carrying = [](std::uint64_t number, std::uint16_t id) {
    WorkspaceVersion version;
    version.description.version = number;
    version.carried.push_back({.id = id, .arm = "arm", .frame = "tool"});
    return version;
  };
  EXPECT_FALSE(sources.version());
  EXPECT_FALSE(sources.server());
  sources.take(kFirst, object(1, "vice"));
  EXPECT_TRUE(sources.commit(kFirst, carrying(7, 1)).accepted);
  sources.take(kSecond, object(2, "drum"));
  EXPECT_FALSE(sources.commit(kSecond, carrying(3, 2)).accepted);
  EXPECT_EQ(sources.carried().front().id, 1);
  EXPECT_EQ(sources.server(), kFirst);
  EXPECT_EQ(sources.gone(kFirst).size(), 2U);
  EXPECT_EQ(sources.server(), kSecond);
  EXPECT_EQ(sources.version()->description.version, 3U);
  EXPECT_EQ(sources.carried().front().id, 2);
}

TEST(ObjectSources, WhoOnlyTalksGivesWayToWhoCommits) {
  ObjectSources sources;
  sources.take(kFirst, object(1, "ghost"));
  sources.take(kSecond, object(2, "vice"));
  const auto committed = sources.commit(kSecond);
  EXPECT_TRUE(committed.accepted);
  ASSERT_EQ(committed.changes.size(), 2U);
  EXPECT_TRUE(committed.changes[0].removed());
  EXPECT_EQ(committed.changes[1].name, "vice");
}

TEST(ObjectSources, ASuccessorsObjectsTakeTheirPlaceAtOnce) {
  ObjectSources sources;
  sources.commit(kFirst);
  for (std::uint16_t id = 1; id <= 3; ++id) sources.take(kFirst, object(id, "old_" + std::to_string(id)));
  EXPECT_TRUE(sources.gone(kFirst).empty()) << "they stay until there are others";
  EXPECT_TRUE(sources.take(kSecond, object(1, "old_1")).changes.empty());
  EXPECT_TRUE(sources.take(kSecond, object(2, "old_2", 0.5)).changes.empty());
  EXPECT_EQ(sources.in_force().size(), 3U);
  const auto committed = sources.commit(kSecond);
  EXPECT_TRUE(committed.accepted);
  ASSERT_EQ(committed.changes.size(), 2U) << "the first is as it was";
  EXPECT_TRUE(committed.changes[0].removed());
  EXPECT_EQ(committed.changes[0].id, 3);
  EXPECT_EQ(committed.changes[1].id, 2);
  EXPECT_EQ(committed.changes[1].X_WO.translation_m.x(), 0.5);
}

TEST(ObjectSources, OneThatCommittedBeforeTheOtherWentFollowsAtOnce) {
  ObjectSources sources;
  sources.take(kFirst, object(1, "vice"));
  sources.commit(kFirst);
  sources.take(kSecond, object(1, "lathe"));
  sources.commit(kSecond);
  const auto changes = sources.gone(kFirst);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].name, "lathe");
}

TEST(ObjectSources, BesideTheOneInForceObjectsAndServersAreBounded) {
  ObjectSources sources;
  sources.take(kFirst, object(1, "vice"));
  sources.commit(kFirst);
  std::size_t accepted = 0;
  for (std::uint16_t id = 1; id < 30'000; ++id)
    accepted += sources.take(kSecond, object(id, "ghost")).accepted ? 1 : 0;
  EXPECT_EQ(accepted, ObjectSources::kMinObjects);
  EXPECT_TRUE(sources.take(kSecond, object(5, "moved")).accepted) << "in place of one that is kept";
  EXPECT_TRUE(sources.take(kThird, object(1, "other")).accepted);
  EXPECT_FALSE(sources.take(kFourth, object(1, "one too many")).accepted);
  EXPECT_FALSE(sources.commit(kFourth).accepted);
  sources.gone(kSecond);
  EXPECT_TRUE(sources.take(kFourth, object(1, "room again")).accepted);
}

/// Whatever comes in whatever order, who makes all the changes shows what is in force.
TEST(ObjectSources, TheChangesAlwaysLeadToWhatIsInForce) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    ObjectSources sources;
    Shown shown;
    for (int step = 0; step < 200; ++step) {
      const SourceId server{static_cast<std::uint8_t>(random() % 4)};
      const auto id = static_cast<std::uint16_t>(1 + random() % 5);
      switch (random() % 8) {
        case 0:
          shown.make(sources.gone(server));
          break;
        case 1:
          shown.make(sources.commit(server).changes);
          break;
        case 2:
          if (sources.of(server).contains(id)) shown.make(sources.take(server, {.id = id}).changes);
          break;
        default:
          const double x_m = static_cast<double>(random() % 3);
          shown.make(sources.take(server, object(id, "of_" + std::to_string(server[0]), x_m)).changes);
      }
      shown.expect(sources.in_force());
    }
  }
}

}  // namespace
}  // namespace phantom::messages
