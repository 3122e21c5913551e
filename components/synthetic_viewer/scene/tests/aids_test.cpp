#include "components/synthetic_viewer/scene/aids.hpp"

#include <gtest/gtest.h>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/pose.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/scene/tests/colour_vision.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Length of the arrow in a frame that holds one: its shaft's and its head's.
double length_m(const Frame& frame) {
  EXPECT_EQ(frame.items.size(), 2U);
  double sum_m = 0.0;
  for (const auto& item : frame.items) sum_m += static_cast<double>(item.W_from_mesh.col(2).head<3>().norm());
  return sum_m;
}

double drawn_m(const Aids& aids, const PgvArrow& arrow) {
  Frame frame;
  add_arrows(frame, aids, arrow);
  return length_m(frame);
}

Aids near(std::optional<double> pgs_Pa_s_per_m, double gap_m = 0.08) {
  Aids aids;
  aids.pgv = {0.0, 0.003, 0.0};
  aids.pgs_Pa_s_per_m = pgs_Pa_s_per_m;
  aids.gap_m = gap_m;
  return aids;
}

// Thesis 6.6.3a: "PGV with length inversely related to PGS"; figure 6.16: the longer, the stronger.
TEST(Arrows, ThatOfTheGradientIsTheShorterTheStrongerItIsOrTheLonger) {
  const PgvArrow inverse, direct{PgvLength::kStrength, 8.0};
  double before_m = 1.0, direct_before_m = 0.0;
  for (const double pgs : {1.0, 2.0, 7.0, 12.0, 20.0}) {
    EXPECT_NEAR(drawn_m(near(pgs), inverse), 0.15 / (1.0 + pgs / 8.0), 1e-6) << pgs;
    EXPECT_LT(drawn_m(near(pgs), inverse), before_m) << pgs;
    before_m = drawn_m(near(pgs), inverse);
    EXPECT_GE(drawn_m(near(pgs), direct), direct_before_m) << pgs;
    direct_before_m = drawn_m(near(pgs), direct);
  }
  EXPECT_NEAR(drawn_m(near(8.0), direct), 0.075, 1e-6);
  EXPECT_NEAR(drawn_m(near(1e5), inverse), 0.03, 1e-6) << "still seen";
  EXPECT_NEAR(drawn_m(near(1e5), direct), 0.15, 1e-4);
}

TEST(Arrows, ByTheGapOrWhereTheStrengthIsNotKnownItSaysTheDistance) {
  EXPECT_NEAR(drawn_m(near(7.0), {PgvLength::kGap, 8.0}), 0.08, 1e-6);
  EXPECT_NEAR(drawn_m(near(std::nullopt), {}), 0.08, 1e-6);
  EXPECT_NEAR(drawn_m(near(std::nullopt, 3.0), {}), 0.12, 1e-6);
}

TEST(Arrows, ThatOfTheMotionIsAsLongAsTheWayOfTheNextHalfSecond) {
  for (const auto& [speed_m_s, wanted_m] : {std::pair{0.02, 0.06}, {0.2, 0.10}, {0.4, 0.20}, {3.0, 0.30}}) {
    Aids aids;
    aids.velocity_m_s = {speed_m_s, 0.0, 0.0};
    EXPECT_NEAR(drawn_m(aids, {}), wanted_m, 1e-6) << speed_m_s;
  }
  Frame still;
  add_arrows(still, {}, {});
  EXPECT_TRUE(still.items.empty());
}

TEST(Arrows, ThatOfTheMotionHasAHeadForEachStepOfDangerAndNoneLeavesIt) {
  for (const auto& [motion, heads] : {std::pair{MotionClass::kNone, 1U},
                                      {MotionClass::kSafe, 1U},
                                      {MotionClass::kNeutral, 2U},
                                      {MotionClass::kDangerous, 3U}}) {
    for (const double speed_m_s : {0.01, 0.3, 3.0}) {
      Aids aids;
      aids.velocity_m_s = {0.0, speed_m_s, 0.0};
      aids.motion = motion;
      Frame frame;
      add_arrows(frame, aids, {});
      ASSERT_EQ(frame.items.size(), 1 + heads);
      const float tip_m = std::clamp(0.5F * static_cast<float>(speed_m_s), 0.06F, 0.30F);
      float behind_m = tip_m;
      for (std::size_t head = 1; head <= heads; ++head) {
        const Eigen::Matrix4f& cone = frame.items[head].W_from_mesh;
        EXPECT_EQ(frame.items[head].mesh, kCone);
        EXPECT_NEAR(cone(1, 3) + cone.col(2).head<3>().norm(), behind_m, 1e-5F);
        EXPECT_GE(cone(1, 3), 0.0F) << "none is behind its foot";
        behind_m -= 0.55F * cone.col(2).head<3>().norm();
      }
    }
  }
}

/// The cone and the plane of a frame that holds just these.
struct ConeAndPlane {
  explicit ConeAndPlane(const Aids& aids) {
    Frame frame;
    add_cone_and_plane(frame, aids);
    EXPECT_EQ(frame.items.size(), 2U);
    for (const DrawItem& item : frame.items)
      (item.mesh == kCone ? cone : plane) = item.W_from_mesh.cast<double>();
  }
  // The cone's shape is from z = 0 to its tip at z = 1, the disc is in z = 0.
  Eigen::Vector3d tip_m() const { return (cone * Eigen::Vector4d(0, 0, 1, 1)).head<3>(); }
  Eigen::Vector3d base_m() const { return (cone * Eigen::Vector4d(0, 0, 0, 1)).head<3>(); }
  Eigen::Vector3d middle_m() const { return plane.col(3).head<3>(); }
  Eigen::Vector3d normal() const { return plane.col(2).head<3>().normalized(); }
  Eigen::Matrix4d cone, plane;
};

Aids at_gap(double gap_m) {
  Aids aids;
  aids.position_m = {0.3, -0.2, 0.5};
  aids.pgv = {0.002, 0.003, -0.006};
  aids.gap_m = gap_m;
  return aids;
}

// Figure 6.19: the cone points at the object, the plane is normal to the PGV where the cone meets it.
TEST(ConeAndPlane, TheTipIsAtTheObjectAndTheBaseAwayFromIt) {
  for (const double gap_m : {0.05, 0.1, 0.2}) {
    const Aids aids = at_gap(gap_m);
    const Eigen::Vector3d way = aids.pgv.normalized();
    const ConeAndPlane drawn(aids);
    EXPECT_TRUE(drawn.tip_m().isApprox(aids.position_m + gap_m * way, 1e-5)) << gap_m;
    EXPECT_TRUE(drawn.base_m().isApprox(aids.position_m, 1e-5)) << gap_m;
    EXPECT_NEAR(drawn.normal().dot(way), 1.0, 1e-6) << gap_m;
    EXPECT_NEAR((drawn.middle_m() - drawn.tip_m()).dot(way), -0.001, 1e-5) << "before the surface";
    EXPECT_NEAR((drawn.middle_m() - drawn.tip_m()).cross(way).norm(), 0.0, 1e-6);
  }
}

TEST(ConeAndPlane, AtAGapTooSmallToSeeTheTipStaysAtTheObjectAndTheConeReachesBack) {
  Aids aids = at_gap(0.005);
  const Eigen::Vector3d way = aids.pgv.normalized(), surface_m = aids.position_m + 0.005 * way;
  EXPECT_TRUE(ConeAndPlane(aids).tip_m().isApprox(surface_m, 1e-5));
  EXPECT_TRUE(ConeAndPlane(aids).base_m().isApprox(surface_m - 0.04 * way, 1e-5));
  aids.scale = 0.2;
  EXPECT_TRUE(ConeAndPlane(aids).base_m().isApprox(surface_m - 0.008 * way, 1e-5)) << "less of it";
}

TEST(ConeAndPlane, WithoutADirectionThereAreNone) {
  Aids aids = at_gap(0.1);
  aids.pgv.setZero();
  Frame frame;
  add_cone_and_plane(frame, aids);
  EXPECT_TRUE(frame.items.empty());
}

// In a bench for surgery a 4 mm vessel was hidden by a marker of 12 mm.
TEST(AidsScale, AMarkerIsThinnerThanAThinObject) {
  EXPECT_DOUBLE_EQ(aids_scale(0.2, 0.1), 1.0);
  EXPECT_DOUBLE_EQ(aids_scale(0.0, 0.1), 1.0) << "not known";
  Frame frame;
  add_marker(frame, {0, 0, 0}, 0.006 * aids_scale(0.004, 0.1), {});
  EXPECT_LE(2.0F * frame.items[0].W_from_mesh.col(0).head<3>().norm(), 0.0021F)
      << "diameter, half the vessel's";
  EXPECT_LT(2.0F * frame.items[1].W_from_mesh.col(0).head<3>().norm(), 0.0045F);
  EXPECT_DOUBLE_EQ(aids_scale(1e-5, 0.1), 0.1) << "still seen";
  EXPECT_LT(aids_scale(0.2, 0.03), aids_scale(0.2, 0.05));
  EXPECT_DOUBLE_EQ(aids_scale(0.2, 0.0), 0.4);
}

TEST(AidsScale, ArrowsAreThinnerAndTheMotionsLengthStaysItsWay) {
  Aids aids = near(8.0);
  aids.scale = 0.25;
  EXPECT_NEAR(drawn_m(aids, {}), 0.25 * 0.075, 1e-6);
  Aids moving;
  moving.velocity_m_s = {0.4, 0.0, 0.0};
  moving.scale = 0.25;
  EXPECT_NEAR(drawn_m(moving, {}), 0.2, 1e-6);
}

geometry::TriangleMesh box_mesh(const Eigen::Vector3d& size_m) { return geometry::make_box(size_m); }

TEST(Thickness, IsTheDiameterOfABarAndTwiceTheThicknessOfAPlate) {
  EXPECT_NEAR(thickness_of(geometry::make_cylinder(0.002, 0.12, 48)), 0.004, 0.0002);
  EXPECT_NEAR(thickness_of(box_mesh({0.4, 0.4, 0.005})), 0.01, 0.0004);
  EXPECT_NEAR(thickness_of(box_mesh({0.3, 0.3, 0.3})), 0.2, 1e-6);
  EXPECT_EQ(thickness_of({}), 0.0);
}

TEST(GrownItem, ReachesFartherByTheErrorOnEachSideOfItsBox) {
  MeshBody body;
  body.box = box_mesh({0.2, 0.1, 0.04}).bounding_box();
  SceneItem item;
  item.mesh = &body;
  item.grown_m = 0.01;
  const geometry::Pose X_WM{geometry::rotation_from_rpy(0.3, -0.2, 1.0), {0.5, 0.6, 0.7}};
  const Eigen::Matrix4d placed = placement_of(item, X_WM);
  const Eigen::Vector3d corner_m = (placed * Eigen::Vector4d(0.1, 0.05, 0.02, 1.0)).head<3>();
  EXPECT_TRUE(corner_m.isApprox(X_WM * Eigen::Vector3d(0.11, 0.06, 0.03), 1e-9));
  const Eigen::Matrix3d linear = placed.topLeftCorner(3, 3);
  EXPECT_GT(linear.determinant(), 0.0);
  item.grown_m = 0.0;
  EXPECT_TRUE((placement_of(item, X_WM) * Eigen::Vector4d(0.1, 0.05, 0.02, 1.0))
                  .head<3>()
                  .isApprox(X_WM * Eigen::Vector3d(0.1, 0.05, 0.02), 1e-12));
}

test::LinearColour colour_of(const Colour& colour) { return {colour[0], colour[1], colour[2]}; }

TEST(Aids, ColoursOfMotionAndClosenessDifferForEveryColourVision) {
  std::vector<test::LinearColour> motions{{0.10, 0.45, 0.85}};  // the PGV's arrow stands beside them
  for (const MotionClass motion :
       {MotionClass::kNone, MotionClass::kSafe, MotionClass::kNeutral, MotionClass::kDangerous})
    motions.push_back(colour_of(motion_colour(motion)));
  for (std::size_t a = 0; a < motions.size(); ++a) {
    for (std::size_t b = a + 1; b < motions.size(); ++b)
      EXPECT_GE(test::least_difference(motions[a], motions[b]), 25) << a << " and " << b;
  }
  for (const auto& [a, b] : {std::pair{0.0, 0.5}, std::pair{0.5, 1.0}, std::pair{0.0, 1.0}})
    EXPECT_GE(test::least_difference(colour_of(closeness_colour(a)), colour_of(closeness_colour(b))), 35)
        << a << " and " << b;
}

}  // namespace
}  // namespace phantom::synthetic_viewer
