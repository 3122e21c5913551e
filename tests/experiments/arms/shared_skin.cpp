// Two processes for one arm's skin (thesis 7.1(7)): the hot cell's arm on a tour, sensed by one phantom and
// by two as shipped in deploy/cells/hot_cell/shared_skin.yaml. A broken law is broken in the second one
// alone: two that do not compute the same must not pass for one.

#include <algorithm>
#include <cmath>
#include <map>

#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace in_shared_skin {
namespace {

using phantom_sensing::PhantomModel;
using phantom_sensing::PhantomSensing;
using phantom_sensing::SensedShare;
using phantom_sensing::StepInputs;
using phantom_sensing::StepOutputs;

constexpr std::size_t kJoints = 7, kShownJoint = 1;
constexpr double kStep_s = 0.1, kTour_s = 30.0;

/// The arm weaves through all that its joints allow, so that now the hand is nearest to something, now
/// another link.
StepInputs at(double t_s, const robot::SerialArm& arm, const workspace::Workspace& world) {
  StepInputs inputs;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const double swing = 0.475 * (joint.upper - joint.lower);
    const double rad_s = 1.0 + 0.2 * static_cast<double>(j);
    inputs.position[j] = 0.5 * (joint.upper + joint.lower) + swing * std::sin(rad_s * t_s);
    inputs.velocity[j] = swing * rad_s * std::cos(rad_s * t_s);
  }
  inputs.dt_s = kStep_s;
  inputs.state_valid = true;
  inputs.workspace = {&world, percept::greatest_neighbour_mu(world)};
  return inputs;
}

/// What differs between one and two, and how much there was to differ.
struct Compared {
  double drag_off = 0.0, torque_off = 0.0;  // shares of the greatest
  int worst_off = 0, alerts_off = 0, sensed_by_the_first = 0, second_worst = 0, felt = 0;
  int raised_by_one = 0, most_raised = 0;  // the latter: times that two raise the same alert
};

bool same_place(const phantom_sensing::SkinPercept& a, const phantom_sensing::SkinPercept& b) {
  return a.mu == b.mu && a.sensor == b.sensor && a.link == b.link && a.object == b.object &&
         a.motion == b.motion && a.rule == b.rule && a.gradient.pgv_W_m == b.gradient.pgv_W_m;
}

void compare(const StepOutputs& one, const StepOutputs& two, Compared& seen) {
  const double greatest_B = *std::max_element(one.drag.coupled.begin(), one.drag.coupled.end());
  double greatest_Nm = 0.0;
  for (const double torque : one.percept.drag_torque) greatest_Nm = std::max(greatest_Nm, std::abs(torque));
  if (greatest_B > 0.0) {
    for (std::size_t k = 0; k < robot::kPackedMatrix; ++k)
      seen.drag_off =
          std::max(seen.drag_off, std::abs(one.drag.coupled[k] - two.drag.coupled[k]) / greatest_B);
    for (std::size_t j = 0; j < kJoints; ++j)
      seen.torque_off = std::max(
          seen.torque_off, std::abs(one.percept.drag_torque[j] - two.percept.drag_torque[j]) / greatest_Nm);
  } else if (two.drag.coupled != one.drag.coupled) {
    seen.drag_off = INFINITY;
  }
  seen.worst_off += same_place(one.percept, two.percept) ? 0 : 1;
  const auto same = [](const auto& a, const auto& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const percept::Alert& x, const percept::Alert& y) {
                        return x.number == y.number && x.at.link == y.at.link && x.at.object == y.at.object;
                      });
  };
  if (!same(one.alerts.raised, two.alerts.raised) || !same(one.alerts.cleared, two.alerts.cleared))
    ++seen.alerts_off;
  seen.raised_by_one += static_cast<int>(one.alerts.raised.size());
  seen.felt += one.percept.mu > 0.0 ? 1 : 0;
}

workspace::Workspace world_of(const runtime::CellConfig& cell, Settings settings, Sabotage sabotage) {
  settings.sabotage = sabotage;
  std::vector<layers::Body> bodies;
  for (runtime::CellBody& body : runtime::load_bodies(cell)) bodies.push_back(std::move(body.body));
  return activate(std::move(bodies), runtime::grid_of(cell), settings, cell.merge);
}

/// Both worlds are the same unless a law is broken.
struct Worlds {
  const workspace::Workspace &of_first, &of_second;
};

/// The whole tour with the skin divided as `config` says. Returns the table.
const Table& tour(Report& report, const std::string& name, const runtime::CellConfig& cell,
                  phantom_sensing::Config config, const Worlds& worlds, Compared& seen) {
  const PhantomModel first = phantom_sensing::load_model(cell, config);
  PhantomModel whole = first;
  whole.shares.clear();
  config.own_share = first.shares.at(0).name;
  const PhantomModel second = phantom_sensing::load_model(cell, config);
  PhantomSensing one(whole, config.percept), two(first, config.percept), helper(second, config.percept);
  Table& table = report.table(
      name, {"time [s]", "one [N·m·s/rad]", "first of two [N·m·s/rad]", "second of two [N·m·s/rad]",
             "sum of two [N·m·s/rad]", "one, worst [Pa·s/m]", "second, worst [Pa·s/m]"});
  std::map<std::uint32_t, int> raised;  // by number, by two
  for (double t_s = 0.0; t_s < kTour_s; t_s += kStep_s) {
    const StepInputs inputs = at(t_s, first.arm, worlds.of_first);
    StepInputs of_second = inputs;
    of_second.workspace = {&worlds.of_second, percept::greatest_neighbour_mu(worlds.of_second)};
    StepOutputs by_one, by_two, by_helper;
    one.step(inputs, by_one);
    helper.step(of_second, by_helper);
    const SensedShare share{by_helper.drag, static_cast<float>(by_helper.percept.mu),
                            by_helper.percept.sensor, by_helper.muted_sensors, by_helper.threats};
    two.begin(inputs, by_two);
    seen.sensed_by_the_first += static_cast<int>(two.end(inputs, {&share}, by_two));
    compare(by_one, by_two, seen);
    for (const percept::Alert& alert : by_two.alerts.raised)
      seen.most_raised = std::max(seen.most_raised, ++raised[alert.number]);
    seen.second_worst += by_one.worst.mu > 0.0 && first.shares[0].links[by_one.worst.link] ? 1 : 0;
    const auto B = [](const StepOutputs& out) { return out.drag.matrix(kShownJoint, kShownJoint); };
    table.row({t_s, B(by_one), B(by_two) - B(by_helper), B(by_helper), B(by_two), by_one.worst.mu,
               by_helper.percept.mu});
  }
  return table;
}

void run(Report& report, const Settings& settings) {
  const std::string folder = (settings.source_dir / "deploy/cells/hot_cell/").string();
  auto cell = runtime::load_cell(folder + "cell.yaml");
  if (settings.fast) cell.voxel_size_m = 2.0 * cell.voxel_size_m;
  const workspace::Workspace world = world_of(cell, settings, Sabotage::kNone);
  const bool is_broken = settings.sabotage != Sabotage::kNone;
  const workspace::Workspace broken = is_broken ? world_of(cell, settings, settings.sabotage) : world;
  const Worlds worlds{world, broken};

  auto config = phantom_sensing::load_config(folder + "shared_skin.yaml");
  Compared seen;
  const Table& table = tour(report, "tour", cell, config, worlds, seen);
  // The gripper, which leads everywhere, with the first.
  config.shares.at(0).links = {"upper_arm", "forearm", "forearm_roll"};
  const Table& other = tour(report, "tour_otherwise", cell, config, worlds, seen);
  Plot& figure =
      report.plot("tour",
                  "The hot cell's arm on a tour, its skin sensed by one process and by two\n"
                  "the second senses (a) forearm roll, wrist and gripper (b) upper arm and forearm",
                  1);
  for (const auto& [name, of] : {std::pair("shipped", &table), std::pair("divided otherwise", &other)})
    figure.panel(name, "time [s]", "coefficient of the second joint [N·m·s/rad]")
        .series(*of, "time [s]", "one [N·m·s/rad]", "one process")
        .series(*of, "time [s]", "sum of two [N·m·s/rad]", "two, added up", Style::kDashed)
        .series(*of, "time [s]", "second of two [N·m·s/rad]", "of which the second has sensed");
  figure.panel("worst sensor", "time [s]", "μ [Pa·s/m]")
      .series(table, "time [s]", "one, worst [Pa·s/m]", "one process", Style::kStep)
      .series(other, "time [s]", "second, worst [Pa·s/m]", "upper arm and forearm", Style::kDashed);

  report.check("sum of two: greatest deviation of the drag matrix from one's, share of its greatest entry",
               seen.drag_off, 0.0, 1e-12, "");
  report.check("drag torque: greatest deviation, share of the greatest", seen.torque_off, 0.0, 1e-9, "");
  report.check("poses at which the worst sensor, its gradient, motion or rule are not one's", seen.worst_off,
               0.0, 0.0, "");
  report.check("poses at which another alert is raised or cleared than by one", seen.alerts_off, 0.0, 0.0,
               "");
  report.check("alerts raised on the tour", seen.raised_by_one, 3.0, 1e3, "");
  report.check("most times that two raise an alert", seen.most_raised, 1.0, 1.0, "");
  report.check("poses at which the first had to sense the second's share, too", seen.sensed_by_the_first, 0.0,
               0.0, "");
  report.check("share of the felt poses at which the worst sensor is the second's",
               static_cast<double>(seen.second_worst) / seen.felt, 0.05, 0.95, "");
  report.prints_no_more("section 7.1(7) (pages 234 to 237) states that it can be done, without figures.");
  report.difference(
      "The thesis proposes several processes for one phantom, by cluster of objects or by arm, without "
      "figures. Ours divide the skin by links: a voxel in the fluid of two objects would count twice if each "
      "had a process, while drag is a sum over links. The first senses by itself what the second does not "
      "deliver in time, so that the percept never depends on it (end-to-end test: shared skin).");
}

}  // namespace
}  // namespace in_shared_skin

Experiment shared_skin() {
  return {"shared-skin",
          "One skin, two processes",
          "section 7.1(7)",
          "Several processes may compute the phantom of one arm; what the operator feels is as from one: the "
          "sum of their drags, the worst of their worst sensors, each alert once.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kGrownBodies},
          in_shared_skin::run};
}

}  // namespace phantom::experiments
