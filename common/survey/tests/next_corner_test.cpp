#include "common/survey/next_corner.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "common/survey/survey.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

/// A part of which one face was measured without errors, and the placement by it.
struct Begun {
  const PartModel& part = part_named("stepped_block");
  geometry::Pose X_WO;
  Measurement measurement;
  NodeMap map;
};
Begun begun(std::size_t faces) {
  Begun b;
  b.X_WO = {geometry::rotation_from_rpy(0.3, 0.2, 0.6), {0.05, -0.02, 0.03}};
  std::mt19937_64 random(5);
  HeadErrors none;
  none.range_m = none.pan_rad = none.tilt_rad = none.targeting_m = 0.0;
  VisibleOptions see;
  see.most_faces = faces;
  b.measurement = *register_nodes(
      test_head(), {},
      *simulate_targetings(b.part, b.X_WO, visible_faces(b.part, b.X_WO, test_head().X_WH.translation_m, see),
                           test_head(), none, random));
  for (const MeasuredNode& node : b.measurement.nodes) {
    const auto nearest =
        std::min_element(b.part.nodes_O_m.begin(), b.part.nodes_O_m.end(), [&](const auto& p, const auto& q) {
          return (b.X_WO * p - node.p_W_m).norm() < (b.X_WO * q - node.p_W_m).norm();
        });
    b.map.push_back(static_cast<std::uint32_t>(nearest - b.part.nodes_O_m.begin()));
  }
  return b;
}

TEST(NextCorner, TheNextFaceIsSeenAndAddsCornersAndSharesTheMeasuredOnes) {
  const Begun b = begun(1);
  const auto face = plan_next_face(b.part, b.X_WO, b.measurement, b.map);
  ASSERT_TRUE(face);
  std::size_t added = 0, shared = 0;
  for (const PlannedCorner& corner : face->corners) {
    const bool near_a_node =
        std::any_of(b.measurement.nodes.begin(), b.measurement.nodes.end(),
                    [&](const MeasuredNode& node) { return (node.p_W_m - corner.p_W_m).norm() < 1e-6; });
    EXPECT_EQ(near_a_node, corner.measured.has_value());
    if (corner.measured) {
      EXPECT_LT((b.measurement.nodes[*corner.measured].p_W_m - corner.p_W_m).norm(), 1e-6);
      ++shared;
    } else {
      ++added;
    }
    EXPECT_TRUE(aim(test_head(), corner.p_W_m));
  }
  EXPECT_GE(added, 2u);
  EXPECT_GE(shared, 1u);
}

TEST(NextCorner, WhenAllThatIsSeenWasMeasuredThereIsNone) {
  const Begun b = begun(100);
  EXPECT_FALSE(plan_next_face(b.part, b.X_WO, b.measurement, b.map));
}

}  // namespace
}  // namespace phantom::survey
