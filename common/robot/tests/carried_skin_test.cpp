// A body that the arm carries is felt as the same mesh would be if it were a part of the link.
#include "common/robot/skin/carried_skin.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot::carried_skin_test {
namespace {

using testing::HasSubstr;

const geometry::TriangleMesh& pump() {
  static const geometry::TriangleMesh mesh = geometry::make_box({0.11, 0.07, 0.16});
  return mesh;
}

/// An arm of three joints; "grip" is a frame on its last link, "held" one that is fixed to "grip" by xyz,
/// rpy.
SerialArm arm_with_frame(const std::string& xyz, const std::string& rpy) {
  using namespace test_arms;
  return load(link("base", 0, "0 0 0") + link("l1", 2, "0 0 -0.1") + link("l2", 1, "0 0 -0.1") +
                  link("l3", 1, "0 0 -0.1") + link("grip", 0, "0 0 0") + link("held", 0, "0 0 0") +
                  moving_joint("j1", "revolute", "base", "l1", "0 0 0", "0.1 0 0", "0 1 0", 1) +
                  moving_joint("j2", "revolute", "l1", "l2", "0.02 0 -0.35", "0 0 0.2", "1 0 0", 1) +
                  moving_joint("j3", "revolute", "l2", "l3", "0 0 -0.3", "0 0 0", "0 0.6 0.8", 1) +
                  R"(<joint name="f1" type="fixed"><parent link="l3"/><child link="grip"/></joint>)" +
                  R"(<joint name="f2" type="fixed"><parent link="l3"/><child link="held"/><origin xyz=")" +
                  xyz + R"(" rpy=")" + rpy + R"("/></joint>)",
              "grip", {Eigen::Matrix3d::Identity(), {0.05, 0.0, 1.3}});
}

/// Skin of all links: tubes, and clusters on the last one.
std::vector<LinkSkin> own_skin() {
  std::vector<LinkSkin> skin;
  for (const char* link : {"l1", "l2", "l3"}) {
    SkinSegment tube;
    tube.to_m = {0.0, 0.0, -0.3};
    tube.from_radius_m = 0.04;
    tube.to_radius_m = 0.03;
    tube.gain = 1.5;
    skin.push_back({link, {tube}, {}, {}});
  }
  SkinSegment netting;
  netting.to_m = {0.0, 0.0, -0.05};
  netting.from_radius_m = netting.to_radius_m = 0.05;
  netting.cluster = ClusterSpec{};
  skin.back().segments.push_back(netting);
  return skin;
}

struct Pair {
  SerialArm arm;
  SkinLayout own, with_body, as_link;
};

template <class Random>
std::string three(Random& random, double most) {
  std::uniform_real_distribution<double> number(-most, most);
  return std::to_string(number(random)) + " " + std::to_string(number(random)) + " " +
         std::to_string(number(random));
}

template <class Random>
Pair make_pair(Random& random, Normalisation normalisation) {
  const SkinOptions options{.voxel_size_m = 0.01, .normalisation = normalisation};
  Pair pair{arm_with_frame(three(random, 0.1), three(random, 3.0)), {}, {}, {}};
  std::vector<LinkSkin> skin = own_skin();
  pair.own = *lay_out_skin(pair.arm, skin, options);
  skin.push_back({"held", {}, {}, {MeshSensors{.mesh_m = pump(), .gain = 1.0, .cluster = {}}}});
  pair.as_link = *lay_out_skin(pair.arm, skin, options);
  const BodySkin body = *lay_out_body(pump(), options);
  const CarriedBody bodies[] = {{"grip", pair.arm.find_frame("held")->second, &body}};
  pair.with_body = *skin_with_bodies(pair.arm, pair.own, bodies, options);
  return pair;
}

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

TEST(CarriedSkin, IsBitForBitThatOfTheSameMeshAsALink) {
  std::mt19937 random(7);
  for (const auto normalisation : {Normalisation::kArea, Normalisation::kActive, Normalisation::kNone,
                                   Normalisation::kCount, Normalisation::kArea}) {
    const auto [arm, own, with_body, as_link] = make_pair(random, normalisation);
    EXPECT_GT(with_body.size(), own.size() + 300);
    EXPECT_EQ(with_body.first, as_link.first);
    EXPECT_EQ(with_body.first_cluster, as_link.first_cluster);
    EXPECT_EQ(with_body.x_m, as_link.x_m);
    EXPECT_EQ(with_body.y_m, as_link.y_m);
    EXPECT_EQ(with_body.z_m, as_link.z_m);
    EXPECT_EQ(with_body.area_m2, as_link.area_m2);
    EXPECT_EQ(with_body.clusters, as_link.clusters);
    EXPECT_EQ(with_body.cluster_kind, as_link.cluster_kind);
    ASSERT_EQ(with_body.weight.size(), as_link.weight.size());
    for (std::size_t i = 0; i < as_link.weight.size(); ++i) {
      if (normalisation == Normalisation::kCount)
        EXPECT_NEAR(with_body.weight[i], as_link.weight[i], 1e-15 * as_link.weight[i]);
      else
        EXPECT_EQ(with_body.weight[i], as_link.weight[i]);
    }
  }
}

TEST(CarriedSkin, IsFeltBitForBitAsTheSameMeshAsALinkAtRandomPoses) {
  const workspace::Workspace world = test_worlds::balls();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  std::size_t felt = 0;
  for (int round = 0; round < 5; ++round) {
    const auto [arm, own, with_body, as_link] = make_pair(random, Normalisation::kArea);
    SkinSensing carried(with_body, {.gradient = true}), link(as_link, {.gradient = true}),
        bare(own, {.gradient = true});
    for (int pose = 0; pose < 40; ++pose) {
      LinkPoses X_WL;
      arm.link_poses({angle(random), angle(random), angle(random)}, X_WL);
      for (SkinSensing* sensing : {&carried, &link, &bare}) sensing->sense(X_WL, arm.joint_count(), world);
      EXPECT_TRUE(same_bits(carried.sums(), link.sums()));
      EXPECT_EQ(carried.active(), link.active());
      EXPECT_EQ(carried.worst().found, link.worst().found);
      EXPECT_EQ(carried.worst().sensor, link.worst().sensor);
      EXPECT_EQ(carried.worst().mu, link.worst().mu);
      felt += carried.active() > bare.active() ? 1 : 0;
    }
  }
  EXPECT_GT(felt, 60U) << "the body seldom meets fluid: this shows little";
}

TEST(CarriedSkin, TheArmsOwnSensorsKeepWhatTheyRemember) {
  const workspace::Workspace world = test_worlds::balls();
  std::mt19937 random(3);
  const auto [arm, own, with_body, as_link] = make_pair(random, Normalisation::kArea);
  const SensingOptions options{.memory = {1.0, 0.9, 0.75, 0.5}};
  SkinSensing before(own, options), all_along(with_body, options), after(with_body, options),
      anew(with_body, options);
  LinkPoses X_WL;
  const auto sense_at = [&](int step, SkinSensing& sensing) {
    arm.link_poses({0.01 * step - 0.3, 0.4, 0.2}, X_WL);
    sensing.sense(X_WL, arm.joint_count(), world);
  };
  bool anew_differs = false;
  for (int step = 0; step < 60; ++step) {
    sense_at(step, all_along);
    if (step < 30) {
      sense_at(step, before);
      continue;
    }
    if (step == 30) {
      const test::HeapGuard guard;
      after.continue_from(before, own);
    }
    sense_at(step, after);
    sense_at(step, anew);
    for (const std::size_t link : {1U, 2U}) {
      EXPECT_EQ(after.sums()[link].mu, all_along.sums()[link].mu) << step;
      anew_differs = anew_differs || anew.sums()[link].mu != all_along.sums()[link].mu;
    }
  }
  EXPECT_TRUE(anew_differs) << "no sensor remembers anything: this shows nothing";
}

TEST(CarriedSkin, SaysWhatIsWrong) {
  const SerialArm arm = arm_with_frame("0 0 0", "0 0 0");
  const SkinOptions options{.voxel_size_m = 0.01};
  const SkinLayout own = *lay_out_skin(arm, own_skin(), options);
  const BodySkin body = *lay_out_body(pump(), options);
  const auto refusal = [&](const std::string& link, const SkinOptions& given) {
    const CarriedBody bodies[] = {{link, {}, &body}};
    const auto skin = skin_with_bodies(arm, own, bodies, given);
    return skin ? std::string() : skin.status().message();
  };
  EXPECT_EQ(refusal("grip", options), "");
  EXPECT_EQ(refusal("claw", options), "the arm has no link 'claw'");
  EXPECT_THAT(refusal("base", options), HasSubstr("does not move"));
  EXPECT_THAT(refusal("grip", {.voxel_size_m = 0.01, .max_sensors = own.size()}),
              HasSubstr("allowed: " + std::to_string(own.size())));
  EXPECT_FALSE(lay_out_body({}, options));
  EXPECT_FALSE(lay_out_body(pump(), {.voxel_size_m = 0.01, .max_sensors = 10}));
}

}  // namespace
}  // namespace phantom::robot::carried_skin_test
