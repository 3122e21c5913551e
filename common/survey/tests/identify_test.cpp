#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdio>
#include <set>

#include "common/core/units.hpp"
#include "common/survey/survey.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

std::set<std::string> names(const Identification& identification) {
  std::set<std::string> found;
  for (const Candidate& candidate : identification.candidates)
    found.insert(shipped_library()[candidate.part].name);
  return found;
}

/// The first `count` faces of a measurement, with the nodes that they need.
Measurement first_faces(const Measurement& whole, std::size_t count) {
  Measurement part;
  part.eye_W_m = whole.eye_W_m;
  std::map<std::size_t, std::size_t> new_index;
  for (std::size_t f = 0; f < count; ++f) {
    MeasuredFace face = whole.faces[f];
    for (std::size_t& node : face.nodes) {
      const auto [known, is_new] = new_index.try_emplace(node, part.nodes.size());
      if (is_new) part.nodes.push_back(whole.nodes[node]);
      node = known->second;
    }
    part.faces.push_back(face);
  }
  return part;
}

TEST(Identify, ThePartThatWasMeasuredIsAmongTheCandidatesAndMoreFacesNeverMakeMore) {
  std::mt19937_64 random(31);
  VisibleOptions three;
  three.most_faces = 3;
  int found = 0, runs = 0;
  for (const PartModel& part : shipped_library()) {
    for (int i = 0; i < 25; ++i) {
      const Measurement m = measure(part, random_pose(random), test_head(), {}, random, three);
      std::set<std::string> before;
      for (std::size_t count = 1; count <= m.faces.size(); ++count) {
        const auto now = names(identify(shipped_library(), first_faces(m, count)));
        for (const std::string& name : now)
          EXPECT_TRUE(count == 1 || before.contains(name)) << name << " came with face " << count;
        before = now;
      }
      found += before.contains(part.name);
      ++runs;
    }
  }
  EXPECT_GE(found, runs - 2) << "a true part is lost beyond four standard deviations only";
}

/// A chain of the given nodes of a part at the identity pose, measured.
Measurement chain(const PartModel& part, const std::vector<std::uint32_t>& nodes, bool closed = false) {
  const RangeHead head = test_head();
  std::vector<Targeting> targetings;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    targetings.push_back({"A", closed, std::to_string(i + 1), *aim(head, part.nodes_O_m[nodes[i]]), {}});
  return *register_nodes(head, {}, targetings);
}

// Tries workspace_survey: several parts
TEST(Identify, ASingleEdgeListsEveryPartThatHasOneOfItsLength) {
  const PartModel& cube = part_named("cube");  // 120 mm
  const BorderLoop& loop = cube.loops.front();
  const auto found = names(identify(shipped_library(), chain(cube, {loop.nodes[0], loop.nodes[1]})));
  EXPECT_THAT(found, testing::ElementsAre("angle_bracket", "cube", "stepped_block", "wedge"));
  const auto result = survey_object(shipped_library(), chain(cube, {loop.nodes[0], loop.nodes[1]}));
  EXPECT_FALSE(result.object);
  EXPECT_THAT(result.refusal,
              testing::AllOf(testing::HasSubstr("several parts fit as well as each other"),
                             testing::HasSubstr("stepped_block"), testing::HasSubstr("wedge")));
  EXPECT_THAT(result.advice, testing::Contains(testing::HasSubstr("its length tells the candidates apart")));
}

TEST(Identify, AFaceSeenFromBehindIsNoFace) {
  const PartModel& wedge = part_named("wedge");
  for (const BorderLoop& loop : wedge.loops) {
    if (loop.nodes.size() != 3) continue;
    const bool faces_head = wedge.faces[loop.face].normal_O.dot(test_head().X_WH.translation_m -
                                                                wedge.nodes_O_m[loop.nodes[0]]) > 0;
    const Measurement m = chain(wedge, loop.nodes, true);
    for (const Candidate& candidate : identify(shipped_library(), m).candidates) {
      for (const Placement& placement : candidate.placements) {
        const Eigen::Vector3d eye_O = placement.fit->X_WO.inverse() * m.eye_W_m;
        bool seen = false;  // the same three corners bound one face only
        for (const BorderLoop& l : shipped_library()[candidate.part].loops) {
          const auto& part = shipped_library()[candidate.part];
          if (l.nodes.size() == 3 && std::set(l.nodes.begin(), l.nodes.end()) ==
                                         std::set(placement.map.begin(), placement.map.end()))
            seen = part.faces[l.face].normal_O.dot(eye_O - part.nodes_O_m[l.nodes[0]]) > 0;
        }
        EXPECT_TRUE(seen);
        if (!faces_head) {
          const geometry::Pose& X = placement.fit->X_WO;
          EXPECT_GT((X.rotation - Eigen::Matrix3d::Identity()).norm() + X.translation_m.norm(), 0.05);
        }
      }
    }
  }
}

TEST(Identify, ACubesFaceFitsInTwentyFourPosesThatOccupyTheSameSpace) {
  const PartModel& cube = part_named("cube");
  std::mt19937_64 random(2);
  VisibleOptions one;
  one.most_faces = 1;
  const Measurement m = measure(cube, random_pose(random), test_head(), {}, random, one);
  const auto result = survey_object({cube}, m);
  ASSERT_TRUE(result.object) << result.refusal;
  EXPECT_EQ(result.object->symmetric, 24u);
  EXPECT_EQ(result.choice.placements.size(), 1u);
}

// Tries workspace_survey: several poses
TEST(Identify, PosesThatOccupyDifferentSpaceAreRefusedAndAFurtherEdgeTellsThemApart) {
  // The step's treads are 60 mm wide and 120 mm long: three of them look alike from above.
  const PartModel& steps = part_named("stepped_block");
  const RangeHead head = test_head();
  const BorderLoop* tread = nullptr;
  for (const BorderLoop& loop : steps.loops) {
    const auto edges = loop.edge_m;
    if (loop.nodes.size() == 4 && std::abs(edges[0] * edges[1] - 0.06 * 0.12) < 1e-6 &&
        steps.faces[loop.face].normal_O.y() > 0.9)
      tread = &loop;
  }
  ASSERT_NE(tread, nullptr);
  geometry::Pose X_WO;
  X_WO.rotation = geometry::rotation_from_rpy(90 * core::kRadPerDegree, 0, 0);  // its y upwards
  std::vector<Targeting> targetings;
  for (std::size_t i = 0; i < 4; ++i)
    targetings.push_back(
        {"tread", true, std::to_string(i + 1), *aim(head, X_WO * steps.nodes_O_m[tread->nodes[i]]), {}});
  const auto result = survey_object({steps}, *register_nodes(head, {}, targetings));
  EXPECT_FALSE(result.object);
  EXPECT_GE(result.choice.placements.size(), 3u);
  EXPECT_THAT(result.refusal, testing::HasSubstr("occupy different space"));
  EXPECT_THAT(result.advice, testing::Contains(testing::HasSubstr("measure the edge that leaves node")));
}

// Tries workspace_survey: not in the library
TEST(Identify, ALibraryWithoutThePartIsToldWithTheNearestMiss) {
  std::mt19937_64 random(4);
  std::vector<PartModel> others;
  for (const PartModel& part : shipped_library()) {
    if (part.name != "wedge") others.push_back(part);
  }
  const Measurement m = measure(part_named("wedge"), {}, test_head(), {}, random);
  const auto result = survey_object(others, m);
  EXPECT_FALSE(result.object);
  EXPECT_THAT(result.refusal, testing::HasSubstr("no part of the library's 8 agrees"));
  EXPECT_THAT(survey_object({}, m).refusal, testing::HasSubstr("library's 0"));
}

// Tries workspace_survey: a bad range
TEST(Survey, OneBadRangeIsRefusedAndNamed) {
  std::mt19937_64 random(14);
  const PartModel& part = part_named("v_groove_block");
  const RangeHead head = test_head();
  geometry::Pose X_WO;
  X_WO.rotation = geometry::rotation_from_rpy(90 * core::kRadPerDegree, 0, 20 * core::kRadPerDegree);
  auto targetings =
      *simulate_targetings(part, X_WO, visible_faces(part, X_WO, head.X_WH.translation_m), head, {}, random);
  targetings[0].reading->range_m += 0.012;
  const auto result = survey_object(shipped_library(), *register_nodes(head, {}, targetings));
  EXPECT_FALSE(result.object);
  EXPECT_THAT(result.advice, testing::Contains(testing::HasSubstr("measure node '1' again")))
      << result.refusal;
}

// Tries workspace_survey: a corner whose readings contradict
// Tries workspace_survey: two nodes on one spot … too few
TEST(Measurement, BadOnesAreNamed) {
  const RangeHead head = test_head();
  const auto at = [&](double x, double y) { return aim(head, {x, y, 0.0}).value(); };
  const auto said = [&](const std::vector<Targeting>& targetings) {
    const auto m = register_nodes(head, {}, targetings);
    return m ? check_measurement(*m).message() : m.status().message();
  };
  EXPECT_THAT(said({{"A", true, "1", at(0, 0), {}},
                    {"A", true, "2", at(0.1, 0), {}},
                    {"A", true, "3", at(0.0005, 0), {}}}),
              testing::HasSubstr("nodes '1' and '3' are on one spot: 0.5 mm apart"));
  EXPECT_THAT(said({{"A", true, "1", at(0, 0), {}},
                    {"A", true, "2", at(0.1, 0), {}},
                    {"A", true, "3", at(0.2, 0.001), {}}}),
              testing::HasSubstr("face 'A' has all its corners in one line (1, 2, 3)"));
  EXPECT_THAT(said({{"A", true, "1", at(0, 0), {}}, {"A", true, "2", at(0.1, 0), {}}}),
              testing::HasSubstr("has 2 corners; allowed: at least 3"));
  EXPECT_THAT(said({{"A", false, "1", at(0, 0), {}}}),
              testing::HasSubstr("has 1 corners; allowed: at least 2"));
  EXPECT_THAT(said({{"A", true, "1", Reading{0.0, 0, 1}, "points.csv:2"}}),
              testing::HasSubstr("points.csv:2: node '1': range 0 m"));
  EXPECT_THAT(said({{"A", true, "1", Reading{std::nan(""), 0, 1}, {}}}), testing::HasSubstr("range nan m"));
  EXPECT_THAT(said({{"A", true, "1", std::nullopt, {}}}), testing::HasSubstr("has no reading"));
  EXPECT_THAT(said({{"A", true, "1", at(0, 0), {}}, {"A", false, "2", at(0.1, 0), {}}}),
              testing::HasSubstr("whole in one row and a part in another"));
  EXPECT_THAT(said({{"A", true, "1", at(0, 0), {}}, {"A", true, "1", at(0.05, 0), {}}}),
              testing::HasSubstr("node '1': measured again 50.0 mm away"));
  EXPECT_THAT(survey_object(shipped_library(), {}).refusal, testing::HasSubstr("nothing was measured"));
}

// Tries workspace_survey: too badly
TEST(Survey, APoseThatIsKnownTooBadlyIsRefusedWithItsDisplacement) {
  std::mt19937_64 random(14);
  geometry::Pose X_WO;
  X_WO.rotation = geometry::rotation_from_rpy(90 * core::kRadPerDegree, 0, 20 * core::kRadPerDegree);
  const Measurement m = measure(part_named("v_groove_block"), X_WO, test_head(), {}, random);
  const auto good = survey_object(shipped_library(), m);
  ASSERT_TRUE(good.object) << good.refusal;
  SurveyOptions strict;
  strict.largest_displacement_m = 0.99 * good.object->worst_displacement_m;
  const auto result = survey_object(shipped_library(), m, strict);
  EXPECT_FALSE(result.object);
  std::array<char, 64> off;
  std::snprintf(off.data(), off.size(), "may be %.1f mm off", 1e3 * good.object->worst_displacement_m);
  EXPECT_THAT(result.refusal,
              testing::AllOf(testing::HasSubstr("v_groove_block"), testing::HasSubstr(off.data())));
}

TEST(Measurement, ReadingsOfOneCornerAreAveragedAndACopyIsNoOtherReading) {
  const RangeHead head = test_head();
  const Reading first = *aim(head, {0, 0, 0});
  Reading second = first;
  second.range_m += 0.002;
  const auto twice = register_nodes(head, {}, {{"A", true, "1", first, {}}, {"A", true, "1", second, {}}});
  ASSERT_TRUE(twice);
  EXPECT_EQ(twice->nodes[0].times, 2);
  EXPECT_NEAR((twice->nodes[0].p_W_m - spot_W_m(head, first)).norm(), 0.001, 1e-6);
  const auto copy = register_nodes(
      head, {},
      {{"A", true, "1", first, {}}, {"B", true, "1", first, {}}, {"C", true, "1", std::nullopt, {}}});
  EXPECT_EQ(copy->nodes[0].times, 1);
  EXPECT_EQ(copy->faces.size(), 3u);
  EXPECT_NEAR(copy->nodes[0].covariance_m2.trace(), 2 * twice->nodes[0].covariance_m2.trace(), 1e-8);
}

}  // namespace
}  // namespace phantom::survey
