#include "common/survey/touch.hpp"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <iostream>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/point_triangle.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey::touch_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The literal twin: every triangle is looked at.
double distance_by_all_m(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double least_m = 1e9;
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
      return mesh.vertices_m[t[i]].cast<double>();
    };
    least_m = std::min(least_m,
                       (p - geometry::closest_point_on_triangle(p, corner(0), corner(1), corner(2))).norm());
  }
  return geometry::winding_number(mesh, p) > 0.5 ? -least_m : least_m;
}

/// What stands really somewhere else than in the model.
struct Fixture {
  explicit Fixture(geometry::TriangleMesh mesh) : mesh_O(std::move(mesh)), surface(mesh_O) {}

  geometry::TriangleMesh mesh_O;
  TouchSurface surface;
  geometry::Pose model_WO, real_WO;

  /// Puts it `shift` and `turn` off, the turn about its middle.
  void deviate(const Eigen::Vector3d& shift_m, const Eigen::Vector3d& turn_rad) {
    const Eigen::Matrix3d R = geometry::rotation_from_vector(turn_rad);
    const Eigen::Vector3d middle_m = model_WO * surface.centre_O_m();
    real_WO = {R * model_WO.rotation, middle_m + R * (model_WO.translation_m - middle_m) + shift_m};
  }

  /// Moves a ball from outside towards a place of the model until it touches the real object; none if it
  /// passes by. The stated error is put on the ball's place along its way.
  std::optional<Touch> touch(const Eigen::Vector3d& at_O_m, const Eigen::Vector3d& normal_O, double radius_m,
                             double sigma_m, std::mt19937_64& random, bool feels_normal = true) const {
    const Eigen::Vector3d way_W = -(model_WO.rotation * normal_O);
    Eigen::Vector3d p_W_m = model_WO * at_O_m - 0.05 * way_W;
    const geometry::Pose X_OW = real_WO.inverse();
    for (double gone_m = 0.0; gone_m < 0.09;) {
      const auto place = surface.nearest(X_OW * p_W_m);
      const double gap_m = place.distance_m - radius_m;
      if (gap_m < 1e-7) {
        const Eigen::Vector3d normal_W = real_WO.rotation * place.normal_O;
        // The error is of the distance to what is touched.
        const double error_m = std::normal_distribution<double>(0.0, sigma_m)(random);
        return Touch{p_W_m + error_m * normal_W, radius_m, sigma_m,
                     feels_normal ? std::optional(normal_W) : std::nullopt};
      }
      p_W_m += gap_m * way_W;
      gone_m += gap_m;
    }
    return std::nullopt;
  }
};

geometry::TriangleMesh block() { return geometry::make_box({0.12, 0.08, 0.06}); }

/// Three places on the top, two on the side −y, one on the end −x, as a fitter would touch a block.
struct Spot {
  Eigen::Vector3d at_O_m, normal_O;
};
std::vector<Spot> three_two_one() {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), front = -Eigen::Vector3d::UnitY(),
                        end = -Eigen::Vector3d::UnitX();
  return {{{-0.030, -0.012, 0.03}, up},  {{0.030, -0.012, 0.03}, up},  {{0.0, 0.012, 0.03}, up},
          {{-0.033, -0.04, 0.0}, front}, {{0.033, -0.04, 0.0}, front}, {{-0.06, 0.0, 0.0}, end}};
}

std::vector<Touch> touch_all(const Fixture& fixture, const std::vector<Spot>& spots, double sigma_m,
                             std::mt19937_64& random, bool feels_normal = true) {
  std::vector<Touch> touches;
  for (const Spot& spot : spots) {
    const auto touch = fixture.touch(spot.at_O_m, spot.normal_O, 0.002, sigma_m, random, feels_normal);
    if (touch) touches.push_back(*touch);
  }
  return touches;
}

/// The error of a corrected pose, (θ, d) about its middle.
Vector6 error_of(const TouchCorrection& c, const Fixture& fixture) {
  Vector6 error;
  error.head<3>() = geometry::rotation_vector(fixture.real_WO.rotation * c.fit.X_WO.rotation.transpose());
  error.tail<3>() =
      fixture.real_WO * fixture.surface.centre_O_m() - c.fit.X_WO * fixture.surface.centre_O_m();
  return error;
}

/// The greatest displacement that remains in what is said to be determined: the error less what lies in the
/// open directions, by the metric of the prior in which the directions are orthogonal.
double determined_error_m(const TouchCorrection& c, const Fixture& fixture,
                          const TouchOptions& options = {}) {
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(options.prior_orientation_sigma_rad),
      Eigen::Vector3d::Constant(options.prior_position_sigma_m);
  const Vector6 error = error_of(c, fixture).cwiseQuotient(prior);
  Vector6 within = Vector6::Zero();
  for (const TouchDirection& d : c.determined) {
    const Vector6 unit = d.motion.cwiseQuotient(prior).normalized();
    within += unit.dot(error) * unit;
  }
  within = within.cwiseProduct(prior);
  double worst_m = 0.0;
  for (const Eigen::Vector3d& p : fixture.surface.extremes_O_m()) {
    const Eigen::Vector3d lever_m = c.fit.X_WO * p - c.fit.centre_W_m;
    worst_m = std::max(worst_m, (within.head<3>().cross(lever_m) + within.tail<3>()).norm());
  }
  return worst_m;
}

Eigen::Vector3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(TouchSurface, ItsDistanceIsThatOfAllTrianglesAndItsNormalTheDistancesSlope) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-0.15, 0.15);
  for (const PartModel& part : shipped_library()) {
    const TouchSurface surface(part.mesh_O);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p(place(random), place(random), place(random));
      const auto found = surface.nearest(p);
      ASSERT_NEAR(found.distance_m, distance_by_all_m(part.mesh_O, p), 1e-9) << part.name;
      const Eigen::Vector3d farther = p + 1e-6 * found.normal_O;
      EXPECT_NEAR(surface.nearest(farther).distance_m - found.distance_m, 1e-6, 2e-8) << part.name;
    }
  }
}

TEST(TouchSurface, AFeltNormalChoosesTheFaceThatLooksThatWay) {
  const TouchSurface surface(block());
  const Eigen::Vector3d p(0.055, 0.0, 0.028);  // inside, nearest to the top, 5 mm from the end +x
  EXPECT_NEAR(surface.nearest(p).distance_m, -0.002, 1e-9);
  const auto end = surface.nearest_facing(p, Eigen::Vector3d::UnitX(), 0.5);
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->distance_m, -0.005, 1e-8);
  EXPECT_NEAR((end->normal_O - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-9);
  geometry::TriangleMesh turned = block();
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_NEAR(TouchSurface(turned).nearest_facing(p, Eigen::Vector3d::UnitX(), 0.5)->distance_m, -0.005, 1e-8)
      << "a mesh that faces inwards is the same body";
  EXPECT_FALSE(surface.nearest_facing(p, Eigen::Vector3d(1, 1, 1).normalized(), 0.9));
}

TEST(Touch, WithoutErrorsSixTouchesGiveThePoseItself) {
  std::mt19937_64 random(2);
  Fixture fixture(block());
  fixture.model_WO = {geometry::rotation_from_rpy(0.1, -0.2, 0.7), {0.4, -0.2, 0.3}};
  fixture.deviate({0.012, -0.006, 0.004}, {0.004, -0.006, 0.010});
  auto touches = touch_all(fixture, three_two_one(), 1e-9, random);
  ASSERT_EQ(touches.size(), 6u);
  for (Touch& touch : touches) touch.sigma_m = 1e-5;  // so little that the prior does not matter
  const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
  ASSERT_TRUE(c) << c.status().message();
  EXPECT_EQ(c->refusal, "");
  EXPECT_TRUE(c->contradicts);
  EXPECT_TRUE(c->open.empty());
  EXPECT_EQ(c->determined.size(), 6u);
  const Vector6 error = error_of(*c, fixture);
  EXPECT_LT(error.head<3>().norm(), 2e-5);
  EXPECT_LT(error.tail<3>().norm(), 2e-6);
  EXPECT_GT(c->moved_m, 0.012);
}

TEST(Touch, ThePoseIsTheMostProbableOneByALiteralCount) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const TouchOptions options;
  for (int run = 0; run < 10; ++run) {
    Fixture fixture(part_named("stepped_block").mesh_O);
    fixture.model_WO = random_pose(random);
    fixture.deviate(0.01 * random_direction(random), 0.01 * random_direction(random));
    std::vector<Touch> touches;
    while (touches.size() < 5) {
      const Eigen::Vector3d way = random_direction(random);
      const auto touch = fixture.touch(fixture.surface.centre_O_m(), way, 0.003, 0.0005, random, false);
      if (touch) touches.push_back(*touch);
    }
    const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {}, options);
    ASSERT_TRUE(c);
    const auto cost = [&](const geometry::Pose& X_WO) {
      const Eigen::Vector3d theta =
          geometry::rotation_vector(X_WO.rotation * fixture.model_WO.rotation.transpose());
      const Eigen::Vector3d d =
          X_WO * fixture.surface.centre_O_m() - fixture.model_WO * fixture.surface.centre_O_m();
      double sum = theta.squaredNorm() / std::pow(options.prior_orientation_sigma_rad, 2) +
                   d.squaredNorm() / std::pow(options.prior_position_sigma_m, 2);
      for (const Touch& t : touches) {
        const double gap_m = distance_by_all_m(fixture.mesh_O, X_WO.inverse() * t.p_W_m) - t.radius_m;
        sum += std::pow(std::min(std::abs(gap_m / t.sigma_m), options.gate_sigmas), 2);
      }
      return sum;
    };
    const double best = cost(c->fit.X_WO);
    EXPECT_LT(best, cost(fixture.model_WO));
    EXPECT_LT(best, cost(fixture.real_WO) + 1e-9) << "the truth has the errors of the touches against it";
    for (const double scale : {0.2, 0.05, 0.01}) {
      for (int i = 0; i < 60; ++i) {
        Vector6 by;
        for (int k = 0; k < 6; ++k) by[k] = scale * (k < 3 ? 0.01 : 0.005) * normal(random);
        geometry::Pose other = c->fit.X_WO;
        const Eigen::Matrix3d R = geometry::rotation_from_vector(by.head<3>());
        other = {R * other.rotation,
                 c->fit.centre_W_m + R * (other.translation_m - c->fit.centre_W_m) + by.tail<3>()};
        ASSERT_GT(cost(other), best - 1e-4 * best - 1e-3) << "run " << run;
      }
    }
  }
}

// 200 runs for each way to touch. What is determined is below 2 mm, what is open is told.
TEST(Touch, AfterSixTouchesWhatTheFacesDetermineIsWithinTwoMillimetres) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> size(0.005, 0.020), angle(-0.0175, 0.0175);
  for (const bool feels_normal : {true, false}) {
    int refused = 0, good = 0, covered = 0;
    double worst_m = 0.0;
    for (int run = 0; run < 200; ++run) {
      Fixture fixture(block());
      fixture.model_WO = random_pose(random);
      fixture.deviate(size(random) * random_direction(random),
                      Eigen::Vector3d(angle(random), angle(random), angle(random)));
      const auto touches = touch_all(fixture, three_two_one(), 0.0003, random, feels_normal);
      const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
      ASSERT_TRUE(c);
      if (!c->refusal.empty()) {
        ++refused;
        continue;
      }
      const double error_m = determined_error_m(*c, fixture);
      worst_m = std::max(worst_m, error_m);
      good += error_m < 0.002 ? 1 : 0;
      double off_m = 0.0;
      for (const Eigen::Vector3d& p : fixture.surface.extremes_O_m())
        off_m = std::max(off_m, (c->fit.X_WO * p - fixture.real_WO * p).norm());
      covered += off_m <= c->worst_after_m ? 1 : 0;
    }
    std::cout << (feels_normal ? "normals felt: " : "normals unknown: ") << good << " of " << 200 - refused
              << " within 2 mm, worst " << 1e3 * worst_m << " mm, " << refused << " refused, " << covered
              << " covered by the stated bound\n";
    EXPECT_LE(refused, feels_normal ? 4 : 40);
    EXPECT_GE(good, (200 - refused) * 99 / 100);
    EXPECT_GE(covered, (200 - refused) * 97 / 100);
  }
}

TEST(Touch, TheStatedCovarianceIsThatOfTheErrors) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  double sum = 0.0;
  constexpr int kRuns = 300;
  for (int run = 0; run < kRuns; ++run) {
    Fixture fixture(block());
    fixture.model_WO = random_pose(random);
    Vector6 by;  // drawn from the prior
    for (int k = 0; k < 6; ++k) by[k] = (k < 3 ? 0.0175 : 0.010) * normal(random);
    fixture.deviate(by.tail<3>(), by.head<3>());
    auto spots = three_two_one();
    spots.resize(4);  // and so one that leaves much to the prior
    const auto touches = touch_all(fixture, spots, 0.0005, random);
    const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
    ASSERT_TRUE(c);
    const Vector6 error = error_of(*c, fixture);
    sum += std::min(error.dot(c->fit.covariance.inverse() * error), 30.0);
  }
  std::cout << "squared error in units of the covariance: " << sum / kRuns << " (6 directions)\n";
  EXPECT_NEAR(sum / kRuns, 6.0,
              0.9);  // standard error √(12/300) = 0.2; the model is linear, the world is not
}

TEST(Touch, OneFaceDeterminesItsNormalAndTwoTurnsAndTheRestIsSaidToBeOpen) {
  std::mt19937_64 random(6);
  Fixture fixture(block());
  fixture.model_WO.translation_m = {0.1, 0.2, 0.3};
  fixture.deviate({0.0, 0.0, 0.012}, Eigen::Vector3d::Zero());
  auto spots = three_two_one();
  spots.resize(3);
  const auto c =
      correct_by_touch(fixture.surface, fixture.model_WO, touch_all(fixture, spots, 0.0001, random), {});
  ASSERT_TRUE(c);
  EXPECT_EQ(c->determined.size(), 3u);
  ASSERT_EQ(c->open.size(), 3u);
  EXPECT_THAT(c->open[0].words, HasSubstr("shift along x of W, 10.0 mm"));
  EXPECT_THAT(c->open[1].words, HasSubstr("shift along y of W, 10.0 mm"));
  EXPECT_THAT(c->open[2].words,
              AllOf(HasSubstr("turn about z of W through (0.100 0.200"), HasSubstr("1.00 deg")));
  EXPECT_NEAR(c->fit.X_WO.translation_m.z(), 0.312, 0.0005);
  EXPECT_NEAR(c->fit.X_WO.translation_m.x(), 0.1, 0.0005) << "nothing is guessed";
  EXPECT_GT(c->worst_after_m, 0.02) << "the guard covers what is open";
}

// A side that is known badly moves the most probable pose, and not the one of what is determined.
TEST(Touch, TheDeterminedPoseIsThatOfTheModelInOpenDirections) {
  std::mt19937_64 random(6);
  Fixture fixture(block());
  fixture.model_WO.translation_m = {0.1, 0.2, 0.3};
  fixture.deviate({0.0, 0.012, 0.012}, Eigen::Vector3d::Zero());
  auto spots = three_two_one();
  spots.resize(5);
  auto touches = touch_all(fixture, spots, 0.0001, random);
  ASSERT_EQ(touches.size(), 5U);
  for (std::size_t i = 3; i < 5; ++i) touches[i].sigma_m = 0.008;
  const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
  ASSERT_TRUE(c);
  ASSERT_THAT(c->open[1].words, HasSubstr("shift along y of W"));
  EXPECT_GT(c->fit.X_WO.translation_m.y(), 0.205);
  const geometry::Pose known_WO = determined_pose(*c, fixture.surface.centre_O_m());
  EXPECT_NEAR(known_WO.translation_m.z(), 0.312, 0.0005);
  EXPECT_NEAR(known_WO.translation_m.y(), 0.2, 2e-4);
  EXPECT_NEAR(known_WO.translation_m.x(), 0.1, 2e-4);
  // Where all is determined, it is the corrected pose.
  const auto whole = correct_by_touch(fixture.surface, fixture.model_WO,
                                      touch_all(fixture, three_two_one(), 0.0001, random), {});
  ASSERT_TRUE(whole && whole->open.empty());
  const geometry::Pose all_WO = determined_pose(*whole, fixture.surface.centre_O_m());
  EXPECT_LT((all_WO.translation_m - whole->fit.X_WO.translation_m).norm(), 1e-9);
  EXPECT_LT((all_WO.rotation - whole->fit.X_WO.rotation).norm(), 1e-9);
}

TEST(Touch, AHoleThatIsTouchedAllRoundLeavesShiftAndTurnAlongItsAxisOpenWhereverItLies) {
  std::mt19937_64 random(7);
  Fixture fixture(geometry::make_cylinder(0.03, 0.12, 64));
  fixture.model_WO = {geometry::rotation_from_rpy(1.5707963, 0.0, 0.0), {0.0, 0.0, 0.5}};  // along −y of W
  fixture.deviate({0.007, 0.0, -0.008}, Eigen::Vector3d::Zero());
  std::vector<Spot> spots;
  for (int i = 0; i < 6; ++i) {
    const double a = 2.0 * i;
    const Eigen::Vector3d out(std::cos(a), std::sin(a), 0.0);
    spots.push_back({0.03 * out + Eigen::Vector3d(0, 0, i % 2 == 0 ? 0.05 : -0.05), out});
  }
  const auto c =
      correct_by_touch(fixture.surface, fixture.model_WO, touch_all(fixture, spots, 0.0001, random), {});
  ASSERT_TRUE(c);
  EXPECT_EQ(c->refusal, "");
  ASSERT_EQ(c->open.size(), 2u);
  EXPECT_THAT(c->open[0].words, HasSubstr("shift along y of W"));
  EXPECT_THAT(c->open[1].words, HasSubstr("turn about y of W"));
  EXPECT_NEAR(c->fit.X_WO.translation_m.x(), 0.007, 0.0005);
  EXPECT_NEAR(c->fit.X_WO.translation_m.z(), 0.492, 0.0005);
}

TEST(Touch, ATouchOfSomethingElseIsNamedAndDoesNotPull) {
  std::mt19937_64 random(8);
  Fixture fixture(block());
  fixture.deviate({0.004, 0.003, -0.005}, Eigen::Vector3d::Zero());
  auto spots = three_two_one();
  spots.push_back({{0.01, 0.0, 0.03}, Eigen::Vector3d::UnitZ()});
  spots.push_back({{0.0, -0.04, 0.01}, -Eigen::Vector3d::UnitY()});
  auto touches = touch_all(fixture, spots, 0.0002, random);
  ASSERT_EQ(touches.size(), 8u);
  touches[6].p_W_m.z() += 0.03;  // a cable above the block
  const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
  ASSERT_TRUE(c);
  EXPECT_THAT(c->unexplained, ElementsAre(6u));
  EXPECT_EQ(c->refusal, "");
  EXPECT_LT(determined_error_m(*c, fixture), 0.002);
}

TEST(Touch, TheSameSpotTouchedAgainIsNoFurtherKnowledge) {
  std::mt19937_64 random(11);
  Fixture fixture(block());
  fixture.deviate({0.004, 0.003, -0.005}, Eigen::Vector3d::Zero());
  const auto once = touch_all(fixture, three_two_one(), 1e-9, random);
  auto often = once;
  for (int i = 0; i < 4; ++i) often.insert(often.end(), once.begin(), once.end());
  for (Touch& touch : often) touch.sigma_m = 0.0005;
  auto single = once;
  for (Touch& touch : single) touch.sigma_m = 0.0005;
  const auto a = correct_by_touch(fixture.surface, fixture.model_WO, single, {}),
             b = correct_by_touch(fixture.surface, fixture.model_WO, often, {});
  EXPECT_LT((a->fit.covariance - b->fit.covariance).norm(), 1e-3 * a->fit.covariance.norm());
}

// Tries workspace_survey: that no pose explains
TEST(Touch, TouchesThatNoPoseExplainsAreRefused) {
  std::mt19937_64 random(9);
  Fixture fixture(block());
  fixture.deviate({0.004, 0.003, -0.005}, Eigen::Vector3d::Zero());
  auto touches = touch_all(fixture, three_two_one(), 0.0002, random);
  for (std::size_t i = 0; i < touches.size(); i += 2) touches[i].p_W_m += Eigen::Vector3d(0.2, 0.1, 0.3);
  const auto c = correct_by_touch(fixture.surface, fixture.model_WO, touches, {});
  ASSERT_TRUE(c);
  EXPECT_THAT(c->refusal, HasSubstr("are explained by no pose that explains the others"));
}

// Tries workspace_survey: touches that two poses explain
TEST(Touch, TwoPosesThatExplainTheTouchesAlikeAreARefusalAndANormalDecides) {
  // A comb of ribs 12 mm apart: a ball in the wrong gap fits as well.
  geometry::TriangleMesh comb;
  for (int i = -3; i <= 3; ++i)
    comb.append(geometry::make_box({0.006, 0.08, 0.04})
                    .transformed({Eigen::Matrix3d::Identity(), {0.012 * i, 0.0, 0.0}}));
  Fixture fixture(std::move(comb));
  const Touch touch{.p_W_m = {0.003 + 0.012 + 0.006, 0.0, 0.0},
                    .sigma_m = 0.0003};  // the face of one rib, or another
  const auto undecided = correct_by_touch(fixture.surface, fixture.model_WO, {touch}, {});
  ASSERT_TRUE(undecided);
  ASSERT_TRUE(undecided->rival_WO);
  EXPECT_THAT(undecided->refusal, HasSubstr("another pose explains the touches as well"));

  Touch felt = touch;
  felt.p_W_m.x() = 0.003 + 0.012 + 0.001;  // 1 mm from one rib's right face, 5 mm from the next one's left
  EXPECT_TRUE(correct_by_touch(fixture.surface, fixture.model_WO, {felt}, {})->rival_WO);
  felt.normal_W = Eigen::Vector3d::UnitX();
  TouchOptions near;
  near.prior_position_sigma_m = 0.003;
  EXPECT_FALSE(correct_by_touch(fixture.surface, fixture.model_WO, {felt}, {}, near)->rival_WO);
}

// Tries workspace_survey: that determine nothing
TEST(Touch, NoContactWhereTheModelHasOnePushesTheModelAwayAndCountsAsEvidence) {
  Fixture fixture(block());
  const FreePlace inside{.p_W_m = {0.0, 0.0, 0.022}, .radius_m = 0.002, .sigma_m = 0.0005};
  const auto c = correct_by_touch(fixture.surface, fixture.model_WO, {}, {inside});
  ASSERT_TRUE(c) << c.status().message();
  EXPECT_TRUE(c->contradicts);
  EXPECT_NEAR(c->fit.X_WO.translation_m.z(), -0.010, 0.001);
  EXPECT_EQ(c->open.size(), 6u) << "an inequality bounds, it determines nothing";
  EXPECT_THAT(c->refusal, HasSubstr("determine nothing"));
  EXPECT_GT(c->worst_before_m, 0.010) << "so far the guard must reach";

  const FreePlace outside{.p_W_m = {0.0, 0.0, 0.033}, .radius_m = 0.002, .sigma_m = 0.0005};
  const auto agrees = correct_by_touch(fixture.surface, fixture.model_WO, {}, {outside});
  EXPECT_FALSE(agrees->contradicts);
  EXPECT_LT(agrees->moved_m, 1e-9);
}

TEST(Touch, TouchesThatAgreeWithTheModelDoNotContradictIt) {
  std::mt19937_64 random(10);
  int contradicted = 0;
  for (int run = 0; run < 200; ++run) {
    Fixture fixture(block());
    fixture.real_WO = fixture.model_WO;
    const auto c = correct_by_touch(fixture.surface, fixture.model_WO,
                                    touch_all(fixture, three_two_one(), 0.0004, random), {});
    contradicted += c->contradicts ? 1 : 0;
    EXPECT_LT(c->moved_m, 0.004);
  }
  EXPECT_LE(contradicted, 8) << "one in a hundred by its confidence";
}

TEST(Touch, BadNumbersAreRefusedByName) {
  const Fixture fixture(block());
  const auto said = [&](const std::vector<Touch>& touches) {
    return correct_by_touch(fixture.surface, fixture.model_WO, touches, {}).status().message();
  };
  EXPECT_THAT(said({}), HasSubstr("nothing was touched"));
  EXPECT_THAT(said({Touch{}, Touch{.p_W_m = {0, std::nan(""), 0}}}), HasSubstr("touch 2"));
  EXPECT_THAT(said({Touch{.sigma_m = 0.0}}), HasSubstr("a sigma above 0"));
  EXPECT_THAT(said({Touch{.normal_W = Eigen::Vector3d(0, 0, 2)}}), HasSubstr("a normal of length 1"));
}

}  // namespace
}  // namespace phantom::survey::touch_test
