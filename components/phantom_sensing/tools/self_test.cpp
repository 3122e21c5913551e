#include "components/phantom_sensing/tools/self_test.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/merge.hpp"
#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_bodies.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr double kVoxel_m = 0.01;
constexpr int kSensors = 5;
constexpr double kSpeed_m_s = 0.05;

template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream stream;
  (stream << ... << parts);
  return stream.str();
}

SelfTestResult failed(const std::string& why) { return {false, "self-test failed: " + why}; }

/// Makes an arm of one joint that slides along +x from `tip_W_m`, with a row of sensors along y at its tip.
PhantomModel make_probe(const Eigen::Vector3d& tip_W_m, int sensors, double voxel_m) {
  robot::DhRow slide;
  slide.link = "probe";
  slide.type = robot::JointType::kPrismatic;
  slide.lower = -10.0;
  slide.upper = 10.0;
  slide.max_speed = slide.max_effort = 1.0;
  geometry::Pose X_WB;  // base z along W x, base x along W −z
  X_WB.rotation << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  X_WB.translation_m = tip_W_m;
  auto arm = robot::SerialArm::from_dh({slide}, robot::DhConvention::kClassic, X_WB);
  if (!arm) throw std::logic_error(arm.status().message());
  robot::AxisSensors row;
  row.count = sensors;
  // Sensors are at k/K of the way, k = 1…K, so that the middle one, or the only one, is at the tip.
  const double half_m = 0.5 * (sensors - 1) * voxel_m;
  row.from_m = Eigen::Vector3d(0, -half_m - voxel_m, 0);
  row.to_m = Eigen::Vector3d(0, half_m, 0);
  auto skin =
      robot::lay_out_skin(*arm, {{"probe", {}, {row}, {}}},
                          {.voxel_size_m = 2.0 * voxel_m, .normalisation = robot::Normalisation::kNone});
  if (!skin) throw std::logic_error(skin.status().message());
  return {*std::move(arm), *std::move(skin), {}};
}

StepInputs at(double q_m, double v_m_s, const SensedWorkspace& workspace) {
  StepInputs inputs;
  inputs.position[0] = q_m;
  inputs.velocity[0] = v_m_s;
  inputs.workspace = workspace;
  inputs.state_valid = true;
  return inputs;
}

/// Makes a grid of 64³ voxels with a block of 8³ and three layers of four voxels around it.
workspace::Workspace known_workspace(const workspace::LayerProfile& profile) {
  const workspace::GridSpec grid{Eigen::Vector3d(-0.32, -0.32, -0.32), kVoxel_m, {64, 64, 64}};
  const layers::Body block{"block", 1, geometry::make_box(Eigen::Vector3d::Constant(7.9 * kVoxel_m)),
                           profile};
  auto palette = workspace::make_palette({profile});
  auto activated = layers::activate_object(block, grid);
  if (!palette || !activated)
    throw std::runtime_error((palette ? activated.status() : palette.status()).message());
  workspace::Workspace workspace(grid, *std::move(palette));
  const workspace::CodeTable codes = workspace::code_table(profile, workspace.palette());
  const std::vector<layers::MergeEntry> entries{{&activated->bricks, 1, &codes}};
  layers::merge_bricks(layers::MergeLaw::kHighestViscosity, entries, layers::keys_of(entries), workspace);
  workspace.version = 1;
  return workspace;
}

/// Returns what is wrong with the percept `depth_vox` voxels before the block, nearing or leaving; empty if
/// nothing is.
std::string wrong_percept(const PhantomModel& model, const PerceptSettings& settings,
                          const SensedWorkspace& workspace, double depth_vox, double expected_mu,
                          bool nearing) {
  PhantomSensing probe(model, settings);
  StepOutputs out;
  const double speed = nearing ? kSpeed_m_s : -kSpeed_m_s;
  probe.step(at(-(4.0 + depth_vox) * kVoxel_m, speed, workspace), out);
  const std::string where =
      text(depth_vox, " voxels before the block, ", nearing ? "nearing" : "leaving", ": ");
  if (!out.valid) return where + "the percept is not valid";
  const auto off = [](double a, double b) { return std::abs(a - b) > 1e-6 * std::max(1.0, std::abs(b)); };
  const SkinPercept& p = out.percept;
  if (off(p.mu, expected_mu)) return where + text("perceived ", p.mu, " Pa·s/m, must be ", expected_mu);
  if (off(p.closeness, expected_mu / workspace.greatest_neighbour_mu))
    return where + text("closeness is ", p.closeness);
  const double drag = kSensors * expected_mu;
  if (nearing && off(out.drag.plus[0], drag))
    return where + text("drag coefficient is ", out.drag.plus[0], ", must be ", drag);
  if (nearing && off(p.drag_torque[0], -drag * kSpeed_m_s))
    return where + text("drag is ", p.drag_torque[0], " N");
  if (out.drag.minus[0] > drag * (1 + 1e-6))
    return where + "drag when leaving is above the symmetric coefficient";
  if (expected_mu == 0.0) return !out.alerts.raised.empty() ? where + "a hit is alerted in free space" : "";
  if (p.object != 1) return where + text("object is ", p.object, ", must be 1");
  const Eigen::Vector3d towards = p.gradient.pgv_W_m.normalized();
  if (!(towards.x() > 0.9)) return where + "the gradient does not point towards the block";
  const double angle = std::acos(std::clamp(nearing ? towards.x() : -towards.x(), -1.0, 1.0));
  const auto motion = kSpeed_m_s < settings.motion.least_speed_m_s  ? percept::MotionClass::kNone
                      : angle < settings.motion.dangerous_below_rad ? percept::MotionClass::kDangerous
                      : angle > settings.motion.safe_above_rad      ? percept::MotionClass::kSafe
                                                                    : percept::MotionClass::kNeutral;
  if (p.motion != motion) return where + "the motion's class is wrong";
  const auto cosine = percept::approach_cosine(p.gradient.pgv_W_m, Eigen::Vector3d(speed, 0, 0),
                                               settings.motion.least_speed_m_s);
  if (p.rule != percept::assess_hit({expected_mu, kSpeed_m_s, cosine}, settings.hit))
    return where + "the rule of a hit is wrong";
  return "";
}

/// Returns the μ that a profile gives an order; none if the profile has no such order.
std::optional<float> mu_of(const workspace::LayerProfile& profile, std::int8_t order) {
  const auto layers = static_cast<int>(profile.mu_Pa_s_per_m.size());
  const auto inside = static_cast<int>(profile.mu_inside_Pa_s_per_m.size());
  if (order >= 1 && order <= layers) return profile.mu_Pa_s_per_m[static_cast<std::size_t>(order - 1)];
  if (order == workspace::kOrderGuard) return profile.mu_Pa_s_per_m.front();
  if (order == workspace::kOrderBoundary && inside > 0) return profile.mu_inside_Pa_s_per_m.front();
  if (order == workspace::kOrderBoundary || order == workspace::kOrderInterior)
    return profile.mu_skin_Pa_s_per_m;
  if (order < 0 && -order <= inside)
    return profile.mu_inside_Pa_s_per_m[static_cast<std::size_t>(-order - 1)];
  return std::nullopt;
}

bool same_grid(const workspace::GridSpec& a, const workspace::GridSpec& b) {
  return a.size_vox == b.size_vox && (a.voxel_size_m.sides_m() - b.voxel_size_m.sides_m()).norm() < 1e-12 &&
         (a.origin_m - b.origin_m).norm() < 1e-9;
}

std::string name_of(workspace::Index3 v) { return text("voxel (", v.x, ", ", v.y, ", ", v.z, ")"); }

/// One voxel of each layer of each object, by object and order.
using Samples = std::map<std::pair<std::uint16_t, std::int8_t>, workspace::Index3>;

/// Checks every voxel of the brick. Returns what is wrong with one, or an empty string.
std::string check_brick(workspace::BrickKey key, const workspace::Workspace& workspace,
                        const runtime::CellConfig& cell, Samples& samples) {
  const workspace::Workspace::BrickView brick = workspace.brick(key);
  for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i) {
    const std::uint16_t object = brick.object_of(i);
    if (object == 0 && brick.mu_code[i] == 0) continue;
    if (object > cell.objects.size()) continue;
    // Inverse of brick_offset().
    const workspace::Index3 v{
        static_cast<std::int32_t>((i >> 6 & 7) << 2 | (i & 3)) + key.x * workspace::kBrickEdge,
        static_cast<std::int32_t>((i >> 9 & 7) << 2 | (i >> 2 & 3)) + key.y * workspace::kBrickEdge,
        static_cast<std::int32_t>((i >> 12 & 7) << 2 | (i >> 4 & 3)) + key.z * workspace::kBrickEdge};
    if (object == 0) return name_of(v) + " has a viscosity and belongs to no object";
    const auto expected = mu_of(cell.objects[object - 1U].profile, brick.order[i]);
    if (!expected || workspace.palette()[brick.mu_code[i]] != *expected) {
      return text(name_of(v), " of ", cell.objects[object - 1U].name, ", order ",
                  static_cast<int>(brick.order[i]), ", has ", workspace.palette()[brick.mu_code[i]],
                  " Pa·s/m, which its profile does not give it");
    }
    if (workspace.grid().contains(v)) samples.try_emplace({object, brick.order[i]}, v);
  }
  return "";
}

}  // namespace

SelfTestResult test_step(const PerceptSettings& settings) {
  workspace::LayerProfile profile;
  profile.thickness_vox = {4, 4, 4};
  profile.mu_Pa_s_per_m = {32.0F, 20.0F, 10.0F};
  const workspace::Workspace workspace = known_workspace(profile);
  const SensedWorkspace sensed{&workspace, percept::greatest_neighbour_mu(workspace)};
  const PhantomModel model =
      make_probe({-0.5 * kVoxel_m, 0.5 * kVoxel_m, 0.5 * kVoxel_m}, kSensors, kVoxel_m);
  // Depths of the voxel of each layer next to the following inner one, where every zone sees a gradient, and
  // of free space.
  constexpr double kDips[][2] = {{0, 32}, {4, 20}, {8, 10}, {14, 0}};
  for (const auto& [depth_vox, mu] : kDips) {
    for (const bool nearing : {true, false}) {
      const std::string wrong = wrong_percept(model, settings, sensed, depth_vox, mu, nearing);
      if (!wrong.empty()) return failed(wrong);
    }
  }
  PhantomSensing probe(model, settings);
  StepOutputs out;
  probe.step(at(0.0, 0.0, sensed), out);
  if (out.percept.mu != 100.0 || out.percept.rule != percept::assess_hit({100.0, 0.0, {}}, settings.hit))
    return failed("inside of the block: its solid is not perceived");
  StepInputs stale = at(-4.5 * kVoxel_m, kSpeed_m_s, sensed);
  stale.state_valid = false;
  probe.step(stale, out);
  if (out.valid || out.drag.plus[0] != 0.0) return failed("a stale state gives a percept");
  return {true, "self-test passed: a probe dipped into a known block perceives each of its layers"};
}

SelfTestResult test_workspace(const workspace::Workspace& workspace, const runtime::CellConfig& cell,
                              const PerceptSettings& settings) {
  if (!same_grid(workspace.grid(), runtime::grid_of(cell)))
    return failed("the workspace's grid is not the one of " + cell.file.string());
  Samples samples;
  for (const workspace::BrickKey key : workspace.bricks()) {
    const std::string wrong = check_brick(key, workspace, cell, samples);
    if (!wrong.empty()) return failed(wrong);
  }
  const SensedWorkspace sensed{&workspace, percept::greatest_neighbour_mu(workspace)};
  std::size_t objects = 0;
  std::uint16_t last = 0;
  for (const auto& [what, v] : samples) {
    const auto& [object, order] = what;
    objects += object != last ? 1U : 0U;
    last = object;
    const PhantomModel model =
        make_probe(workspace.grid().centre_of(v), 1, workspace.grid().voxel_size_m.reference_m());
    PhantomSensing probe(model, settings);
    StepOutputs out;
    probe.step(at(0.0, 0.0, sensed), out);
    const auto expected = static_cast<double>(*mu_of(cell.objects[object - 1U].profile, order));
    if (out.percept.mu != expected || out.percept.object != object) {
      return failed(text("a probe in ", name_of(v), " of ", cell.objects[object - 1U].name, " perceived ",
                         out.percept.mu, " Pa·s/m of object ", out.percept.object, ", must be ", expected));
    }
  }
  return {true, text("self-test passed: ", samples.size(), " layers of ", objects,
                     " objects perceived in version ", workspace.version)};
}

}  // namespace phantom::phantom_sensing
