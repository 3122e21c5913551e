#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

/// The seven-cornered face of the thesis's figure A.14, measured nearly head-on, with errors in some ranges.
Measurement seven_corners(const HeadErrors& stated, const std::map<std::string, double>& range_error_m) {
  const PartModel& part = part_named("v_groove_block");
  const RangeHead head = test_head();
  geometry::Pose X_WO;  // its end z = 180 mm faces the head
  const Eigen::Vector3d way = head.X_WH.translation_m.normalized();
  X_WO.rotation = geometry::rotation_between(Eigen::Vector3d::UnitZ(), way);
  VisibleOptions options;
  options.most_faces = 1;
  HeadErrors none;
  none.range_m = none.pan_rad = none.tilt_rad = none.targeting_m = 0.0;
  std::mt19937_64 random(1);
  auto targetings = *simulate_targetings(
      part, X_WO, visible_faces(part, X_WO, head.X_WH.translation_m, options), head, none, random);
  EXPECT_EQ(targetings.size(), 7u);
  for (Targeting& t : targetings) {
    if (const auto error = range_error_m.find(t.node); error != range_error_m.end())
      t.reading->range_m += error->second;
  }
  return *register_nodes(head, stated, targetings);
}

std::vector<std::string> suspects(const Measurement& m, const FaceCheck& check) {
  std::vector<std::string> names;
  for (const NodeCheck& node : check.nodes) {
    if (node.suspect) names.push_back(m.nodes[node.node].name);
  }
  return names;
}

TEST(ErrorAid, OnAFaceWithoutErrorsAllNormalsAreParallelAndNothingIsSaid) {
  const Measurement m = seven_corners({}, {});
  const FaceCheck check = check_face(m, m.faces[0]);
  for (const NodeCheck& node : check.nodes) {
    EXPECT_LT(node.normal_departs_rad, 1e-9);
    EXPECT_NEAR(node.off_plane_m, 0.0, 1e-9);
  }
  EXPECT_TRUE(suspects(m, check).empty());
  EXPECT_TRUE(advice(m, m.faces[0], check).empty());
}

// Figure A.15: +6 mm at node 3, −2 mm at node 5.
TEST(ErrorAid, TheThesissTwoBadRangesAreFoundWithAnInstrumentThatCanTellThem) {
  HeadErrors fine;
  fine.range_m = 0.0006;
  fine.pan_rad = fine.tilt_rad = 0.00005;
  fine.targeting_m = 0.0001;
  const Measurement m = seven_corners(fine, {{"3", 0.006}, {"5", -0.002}});
  const FaceCheck check = check_face(m, m.faces[0]);
  EXPECT_THAT(suspects(m, check), testing::ElementsAre("3", "5"));
  EXPECT_NEAR(check.nodes[2].off_plane_m, 0.006, 1e-4);
  EXPECT_NEAR(check.nodes[4].off_plane_m, -0.002, 1e-4);
  const auto said = advice(m, m.faces[0], check);
  EXPECT_THAT(said,
              testing::Contains(testing::HasSubstr("measure node '3' again: its range is 6.0 mm too long")));
  EXPECT_THAT(said, testing::Contains(testing::HasSubstr("node '5' again: its range is 2.0 mm too short")));
}

TEST(ErrorAid, WithTheThesissInstrumentTheSixMillimetresAreFoundAndTwoAreWithinItsErrors) {
  const Measurement m = seven_corners({}, {{"3", 0.006}, {"5", -0.002}});
  const FaceCheck check = check_face(m, m.faces[0]);
  EXPECT_THAT(suspects(m, check), testing::ElementsAre("3"));
}

TEST(ErrorAid, OfFourCornersNobodyCanTellWhichIsBad) {
  const PartModel& part = part_named("brick");
  const RangeHead head = test_head();
  HeadErrors none;
  none.range_m = none.pan_rad = none.tilt_rad = none.targeting_m = 0.0;
  std::mt19937_64 random(1);
  VisibleOptions options;
  options.most_faces = 1;
  auto targetings = *simulate_targetings(part, {}, visible_faces(part, {}, head.X_WH.translation_m, options),
                                         head, none, random);
  ASSERT_EQ(targetings.size(), 4u);
  targetings[1].reading->range_m += 0.02;
  const Measurement m = *register_nodes(head, HeadErrors{}, targetings);
  const FaceCheck check = check_face(m, m.faces[0]);
  EXPECT_EQ(check.alternatives.size(), 3u);
  EXPECT_THAT(advice(m, m.faces[0], check),
              testing::Contains(testing::HasSubstr("or, explaining it as well: ")));
  targetings.resize(3);
  const Measurement three = *register_nodes(head, HeadErrors{}, targetings);
  EXPECT_FALSE(check_face(three, three.faces[0]).redundant) << "three corners always lie on a plane";
}

// False alarms come as often as stated: the plane's χ² is one.
TEST(ErrorAid, GoodFacesRaiseSuspicionAboutAsSeldomAsStated) {
  const PartModel& part = part_named("v_groove_block");
  HeadErrors normal;
  normal.law = ErrorLaw::kNormal;
  std::mt19937_64 random(5);
  int alarms = 0, runs = 0;
  double chi2 = 0.0, degrees = 0.0;
  while (runs < 1500) {
    const Measurement m = measure(part, random_pose(random), test_head(), normal, random);
    for (const MeasuredFace& face : m.faces) {
      if (face.nodes.size() < 4) continue;
      const Plane plane = fit_plane(m, face.nodes);
      chi2 += plane.chi2;
      degrees += plane.degrees;
      alarms += !suspects(m, check_face(m, face)).empty();
      ++runs;
    }
  }
  EXPECT_NEAR(chi2 / degrees, 1.0, 5 * std::sqrt(2.0 / degrees));
  EXPECT_LT(alarms, kSuspicion * runs + 5 * std::sqrt(kSuspicion * runs)) << "of " << runs;
}

}  // namespace
}  // namespace phantom::survey
