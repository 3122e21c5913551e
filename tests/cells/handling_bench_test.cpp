// What the shipped handling bench promises of its world, by the arm's position loops and the reaches of its
// file: the pump goes where it is put, the probe leaves its rack, and each touch of it meets the fixture
// where that really stands.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "common/geometry/mesh/solid_moments.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/simulation/mesh_world.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "components/master_io/reaches/reaches.hpp"
#include "components/slave_io/simulated_arm.hpp"

namespace phantom {
namespace {

const std::filesystem::path kBench = PHANTOM_SOURCE_DIR "/deploy/cells/handling";
constexpr double kPeriod_s = 0.001;
constexpr std::size_t kPump = 0, kProbe = 1;  // among the loose objects

std::vector<simulation::LooseObject> loose_of(const runtime::CellConfig& cell) {
  std::vector<simulation::LooseObject> loose;
  for (runtime::LooseMesh& body : runtime::load_loose_bodies(cell)) {
    const geometry::SolidMoments moments = geometry::solid_moments(body.mesh_O);
    loose.push_back({body.id,
                     std::move(body.mesh_O),
                     {body.mass_kg, moments.centre_m, body.mass_kg * moments.inertia_m2, body.X_WO}});
  }
  return loose;
}

class HandlingBench : public testing::Test {
 protected:
  HandlingBench() { plant_.grip(0.1, 40.0); }

  const simulation::ContactReport& contact() { return plant_.contact(); }
  geometry::Pose pose(std::size_t loose) { return plant_.pose_of_loose(loose); }
  std::string object_name(std::uint16_t id) const { return id == 0 ? "" : cell_.objects[id - 1U].name; }

  void tick(const core::JointArray& q_ref, const core::JointArray& v_ref) {
    const auto torque = servo_.step(q_ref, v_ref, plant_.position(), plant_.velocity(), {});
    plant_.step(torque.drive_Nm, kPeriod_s);
  }
  /// Goes to `q` as the operator does; ends early 0.1 s after a contact begins, if that is wanted.
  void go(const core::JointArray& q, double seconds, bool until_contact = false) {
    const core::JointArray from = reference_;
    double touching_s = 0.0;
    for (double t = 0.0; t < seconds && touching_s < 0.1; t += kPeriod_s) {
      const simulation::Progress progress = simulation::minimum_jerk(t / seconds);
      core::JointArray v{};
      for (std::size_t j = 0; j < 6; ++j) {
        reference_[j] = from[j] + progress.share * (q[j] - from[j]);
        v[j] = progress.rate / seconds * (q[j] - from[j]);
      }
      tick(reference_, v);
      most_N_ = std::max(most_N_, contact().force_N);
      if (until_contact && (touching_s > 0.0 || contact().contact)) touching_s += kPeriod_s;
      if (until_contact && contact().contact && !touched_) touched_ = contact();
    }
  }
  void wait(double seconds) {
    for (double t = 0.0; t < seconds; t += kPeriod_s) tick(reference_, {});
  }
  void reach(const simulation::Reach& reach) {
    touched_.reset();
    most_N_ = 0.0;
    go(reach.from, 3.0);
    go(reach.target, 4.0, true);
    if (reach.gripper != simulation::GripperAction::kNone)
      plant_.grip(reach.gripper == simulation::GripperAction::kOpen ? 0.1 : 0.0, 40.0);
    wait(reach.hold_s.value_or(0.3));
    go(reach.from, 2.0);
  }

  const runtime::CellConfig cell_ = runtime::load_cell(kBench / "cell.yaml");
  const slave_io::ArmModel model_ = slave_io::load_arm(cell_, "");
  const slave_io::Config config_ = slave_io::load_config(kBench / "slave_io.yaml", model_.arm, model_.home);
  const simulation::MeshWorld world_{runtime::load_real_bodies(cell_), config_.contact.clearance_range_m};
  const teleop::JointServo servo_{model_.arm.joint_count(), config_.gains};
  slave_io::SimulatedArm arm_{model_, config_, world_, loose_of(cell_)};
  simulation::SlavePlant& plant_ = arm_.plant();
  core::JointArray reference_ = model_.home;
  std::optional<simulation::ContactReport> touched_;
  double most_N_ = 0.0;
};

TEST_F(HandlingBench, ItsReachesDoWhatTheirNamesSay) {
  const auto reaches = master_io::load_reaches(kBench / "reaches.yaml", model_.arm);
  wait(1.0);
  EXPECT_LT((pose(kPump).translation_m - cell_.objects[1].X_WO.translation_m).norm(), 1e-3) << "it stands";
  EXPECT_LT((pose(kProbe).translation_m - cell_.objects[4].X_WO.translation_m).norm(), 2e-3) << "in its rack";

  reach(reaches.at(0).reach);
  ASSERT_TRUE(plant_.holds(kPump));
  EXPECT_NEAR(plant_.gripper()->width_m(), 0.04, 0.001);
  EXPECT_GT(pose(kPump).translation_m.z(), 0.65);
  reach(reaches.at(1).reach);
  EXPECT_EQ(object_name(touched_->object), "table") << "the pump touched it";
  EXPECT_LT(most_N_, 150.0);
  EXPECT_FALSE(plant_.holds(kPump));
  const geometry::Pose put = pose(kPump);
  EXPECT_LT((put.translation_m - Eigen::Vector3d(0.1539, 0.4229, 0.5)).norm(), 0.01) << put.translation_m;
  EXPECT_GT(put.rotation(2, 2), 0.9999) << "it stands upright";

  reach(reaches.at(2).reach);
  ASSERT_TRUE(plant_.holds(kProbe));
  EXPECT_LT((pose(kPump).translation_m - put.translation_m).norm(), 1e-3);
  const runtime::ObjectConfig& fixture = cell_.objects[5];
  const geometry::Pose X_FW = (fixture.X_WO * fixture.X_deviation).inverse();
  for (std::size_t i = 3; i < reaches.size(); ++i) {
    reach(reaches[i].reach);
    ASSERT_TRUE(touched_) << reaches[i].label.name;
    EXPECT_EQ(object_name(touched_->object), "fixture") << reaches[i].label.name;
    const Eigen::Vector3d at_m = X_FW * touched_->point_W_m;
    const Eigen::Vector3d beyond_m = at_m.cwiseAbs() - Eigen::Vector3d(0.06, 0.04, 0.03);
    EXPECT_NEAR(beyond_m.maxCoeff(), 0.0, 1e-3) << "on its real surface: " << reaches[i].label.name;
    EXPECT_LT(most_N_, 100.0);
    ASSERT_TRUE(plant_.holds(kProbe));
  }
}

}  // namespace
}  // namespace phantom
