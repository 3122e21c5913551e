// Which links threaten which objects, in the shipped cells, against a literal twin that judges every sensor.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "common/percept/closeness.hpp"
#include "components/phantom_sensing/model.hpp"

namespace phantom::phantom_sensing {
namespace {

using LinkAndObject = std::pair<std::size_t, std::uint16_t>;

/// A shipped cell with its arm's phantom.
struct ThreatCell {
  explicit ThreatCell(const std::string& name, const std::string& arm)
      : cell(runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/" + name)),
        config{.arm = arm},
        model(load_model(cell, config)),
        voxels(build_workspace(cell)) {}

  StepInputs random_inputs(std::mt19937& random) const {
    StepInputs inputs;
    for (std::size_t j = 0; j < model.arm.joint_count(); ++j) {
      const robot::Joint& joint = model.arm.joints()[j];
      inputs.position[j] = std::uniform_real_distribution(joint.lower, joint.upper)(random);
      inputs.velocity[j] = std::uniform_real_distribution(-0.5, 0.5)(random) * joint.max_speed;
    }
    inputs.state_valid = true;
    inputs.workspace = {&voxels, percept::greatest_neighbour_mu(voxels)};
    return inputs;
  }

  runtime::CellConfig cell;
  Config config;
  PhantomModel model;
  workspace::Workspace voxels;
};

/// So many sensors of a link at an object's fluid must be found; of large skins not every sensor is looked
/// at.
constexpr int kSurelyFound = 16;

/// Assesses each sensor by itself, with its own voxel, velocity and gradient. Returns for each threat how
/// many sensors have it, up to kSurelyFound; an interest point counts for as many.
std::map<LinkAndObject, int> every_sensor(const ThreatCell& in, const StepInputs& inputs) {
  const PerceptSettings settings;
  const percept::ClusterZone zone(settings.cluster_reach_vox, settings.cluster_shape);
  robot::LinkPoses X_WL;
  in.model.arm.link_poses(inputs.position, X_WL);
  std::map<LinkAndObject, int> threats;
  const auto assess = [&](std::size_t link, const Eigen::Vector3d& p_W_m, int counts) {
    const workspace::Index3 voxel = in.voxels.grid().index_of(p_W_m);
    const auto mu = static_cast<double>(in.voxels.mu(voxel));
    if (mu == 0.0) return;
    const LinkAndObject which{link, in.voxels.object(voxel)};
    if (const auto found = threats.find(which); found != threats.end() && found->second >= kSurelyFound)
      return;
    const Eigen::Vector3d v_m_s = in.model.arm.point_velocity_W(link, p_W_m, X_WL, inputs.velocity);
    const double speed_m_s = v_m_s.norm();
    if (percept::assess_hit({mu, speed_m_s, 1.0}, settings.hit) == percept::HitRule::kNone) return;
    const auto cosine = percept::approach_cosine(zone.gradient(in.voxels, voxel).pgv_W_m, v_m_s,
                                                 settings.motion.least_speed_m_s);
    if (percept::assess_hit({mu, speed_m_s, cosine}, settings.hit) != percept::HitRule::kNone)
      threats[which] += counts;
  };
  const robot::SkinLayout& skin = in.model.skin;
  for (std::size_t link = 1; link <= in.model.arm.joint_count(); ++link)
    for (std::size_t i = skin.first[link]; i < skin.first[link + 1]; ++i)
      assess(link, X_WL[link] * skin.position(i), 1);
  for (const InterestPoint& point : in.model.interest_points)
    assess(point.link, X_WL[point.link] * point.position_m, kSurelyFound);
  return threats;
}

std::set<LinkAndObject> found_in(const StepOutputs& out) {
  std::set<LinkAndObject> threats;
  for (const Threat& threat : out.threats)
    if (threat.raises) threats.insert({threat.link, threat.object});
  return threats;
}

/// What differs over some random poses and speeds.
struct Differences {
  int threats = 0, missed = 0, missed_of_few = 0, invented = 0;
};
Differences differences(const ThreatCell& in, int poses, unsigned seed) {
  std::mt19937 random(seed);
  Differences seen;
  PhantomSensing sensing(in.model, {});
  StepOutputs out;
  for (int i = 0; i < poses; ++i) {
    const StepInputs inputs = in.random_inputs(random);
    sensing.step(inputs, out);
    const auto expected = every_sensor(in, inputs);
    const auto found = found_in(out);
    seen.threats += static_cast<int>(expected.size());
    for (const auto& [one, sensors] : expected)
      if (!found.contains(one)) ++(sensors >= kSurelyFound ? seen.missed : seen.missed_of_few);
    for (const auto& one : found) seen.invented += expected.contains(one) ? 0 : 1;
  }
  return seen;
}

struct ThreatCase {
  const char *cell, *arm;
};
class ThreatSearch : public testing::TestWithParam<ThreatCase> {};

TEST_P(ThreatSearch, SR20_FindsTheThreatsThatALookAtEverySensorFinds) {
  const ThreatCell in(GetParam().cell, GetParam().arm);
  const Differences seen = differences(in, 100, 45);
  EXPECT_GT(seen.threats, 10);
  EXPECT_EQ(seen.invented, 0);
  EXPECT_LE(seen.missed, seen.threats / 100) << "of " << seen.threats;
  EXPECT_LE(seen.missed_of_few, 1 + seen.threats / 20) << "of " << seen.threats;
}

INSTANTIATE_TEST_SUITE_P(Cells, ThreatSearch,
                         testing::Values(ThreatCase{"hot_cell/cell.yaml", ""},
                                         ThreatCase{"two_plates/cell.yaml", ""},
                                         ThreatCase{"gripper_bench/cell.yaml", ""},
                                         ThreatCase{"surgery_bench/cell.yaml", ""}));

}  // namespace
}  // namespace phantom::phantom_sensing
