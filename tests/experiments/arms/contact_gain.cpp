// A person pushes on after the slave has met the bar: an unbalanced arm's feedback with a small 1/A, with one
// that rises on contact, and with a great one throughout (thesis 5.4.7, items 3 and 4).

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/experiments/arms/bar_rig.hpp"
#include "tests/experiments/arms/teleop_rig.hpp"

namespace phantom::experiments {
namespace in_contact_gain {
namespace {

constexpr double kAim_deg = 60.0;  // far beyond the bar: the hand would go on until it is stopped
constexpr double kReach_s = 6.0;
constexpr double kInverse_a = 0.004;  // as in `coworking`
constexpr double kRatio = 8.0;
constexpr double kFree_from_deg = 5.0, kFree_to_deg = 25.0;  // before the innermost layer

struct Trial {
  const char* table;
  const char* name;
  double inverse_a, ratio;
  master_io::ContactSource source;
};
constexpr std::array<Trial, 4> kTrials{
    {{"low", "1/A small throughout", kInverse_a, 1.0, master_io::ContactSource::kEither},
     {"by_slave", "1/A rises by the slave's sensor", kInverse_a, kRatio, master_io::ContactSource::kSlave},
     {"by_phantom", "1/A rises by the phantom alone", kInverse_a, kRatio, master_io::ContactSource::kPhantom},
     {"high", "1/A great throughout", kRatio* kInverse_a, 1.0, master_io::ContactSource::kEither}}};

struct Pushed {
  std::vector<Moment> moments;  // from the start of the reach
  double free_Nm = 0.0;         // mean of the slave's feedback in free space
  double past_deg = 0.0;        // how far the hand got beyond the bar
  double held_Nm = 0.0;         // of the hand in the end
  double force_N = 0.0;         // on the bar in the end
  double raised_deg = 0.0;      // where the slave was as 1/A rose
};

Pushed push(const Trial& trial, const Settings& settings) {
  TeleopSetup setup = teleop_setup(settings, "minimum_jerk", "sctfb");
  setup.slave.plant.balanced = false;
  auto& feedback = setup.master.feedback;
  feedback.inverse_a[static_cast<std::size_t>(teleop::BilateralLaw::kSctfb)] =
      teleop::everywhere(trial.inverse_a);
  feedback.contact_gain_ratio = trial.ratio;
  setup.master.contact_source = trial.source;
  clamp_percept(setup, kThesisClamp_Nm);
  set_swing(setup, rad(kAim_deg), kReach_s);
  TeleopRig rig(setup, settings);
  while (!rig.step().swinging) {
  }
  Pushed found;
  double free = 0.0;
  while (found.moments.size() < 10000) {
    const Moment& now = found.moments.emplace_back(rig.step());
    const double slave_deg = degrees(now.slave_rad);
    found.past_deg = std::max(found.past_deg, degrees(now.master_rad) - kContact_deg);
    if (found.raised_deg == 0.0 && now.inverse_a > 1.05 * trial.inverse_a) found.raised_deg = slave_deg;
    if (found.raised_deg > 0.0 || slave_deg < kFree_from_deg || slave_deg > kFree_to_deg) continue;
    found.free_Nm += now.sffb_Nm;
    free += 1.0;
  }
  found.free_Nm /= free;
  found.held_Nm = found.moments.back().mlt_Nm;
  found.force_N = found.moments.back().force_N;
  return found;
}

/// Mean torque that the arm's weight asks of the hand over the same way.
double weight_Nm(const Settings& settings) {
  const TeleopSetup setup = teleop_setup(settings, "minimum_jerk", "sctfb");
  double sum = 0.0, count = 0.0;
  for (double angle_deg = kFree_from_deg; angle_deg <= kFree_to_deg; angle_deg += 0.5, count += 1.0) {
    core::JointArray q{};
    q[kTheta] = rad(angle_deg);
    robot::LinkPoses X_WL;
    setup.arm.arm.link_poses(q, X_WL);
    sum += setup.arm.arm.gravity_torque(X_WL)[kTheta];
  }
  return kInverse_a * sum / count;
}

/// Angle at which the link's axis comes into the bar's innermost layer, as it is meant.
double innermost_layer_deg(const Settings& settings) {
  const auto cell = bar_cell({.source_dir = settings.source_dir});
  const double thickness_m =
      cell.objects.front().profile.thickness_vox.front() * cell.voxel_size_m.reference_m();
  for (double angle_deg = 0.0; angle_deg < kContact_deg; angle_deg += 0.01)
    for (double r_m = 0.0; r_m <= kLink_m; r_m += 0.005)
      if (bar_distance_m(r_m, rad(angle_deg)) <= thickness_m) return angle_deg;
  return kContact_deg;
}

void draw(Report& report, const std::array<Pushed, 4>& trials) {
  Plot& plot = report.plot(
      "push",
      "A person reaches 20° beyond where the bar stops the slave, an arm without counterweights\n"
      "1/A = 0.004; in contact, or throughout, 8 times that; hand of 2.5 N·m, percept clamped at 2.2 kg·cm",
      2);
  Panel& angle = plot.panel("the hand", "time from the start of the reach [s]", "θ of the master [°]");
  Panel& torque = plot.panel("what it feels of the slave", "θ of the master [°]", "SCTFB [N·m]");
  for (std::size_t i = 0; i < trials.size(); ++i) {
    Table& table = report.table(kTrials[i].table, {"time [s]", "θ of the master [°]", "SCTFB [N·m]", "1/A"});
    const double start_s = trials[i].moments.front().t_s;
    for (std::size_t k = 0; k < trials[i].moments.size(); k += 10) {
      const Moment& now = trials[i].moments[k];
      table.row({now.t_s - start_s, degrees(now.master_rad), now.sffb_Nm, now.inverse_a});
    }
    angle.series(table, "time [s]", "θ of the master [°]", kTrials[i].name);
    torque.series(table, "θ of the master [°]", "SCTFB [N·m]", kTrials[i].name);
  }
  angle.horizontal(kContact_deg, "contact");
  torque.vertical(kContact_deg, "contact");
}

void run(Report& report, const Settings& settings) {
  std::array<Pushed, 4> trials;
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i] = push(kTrials[i], settings);
  draw(report, trials);
  const auto& [low, by_slave, by_phantom, high] = trials;
  const double hand_Nm = teleop_setup(settings, "minimum_jerk", "sctfb").master.hand.max_force[kTheta];
  // What 80 N·m of drive give through 1/A = 0.004 is an eighth of the hand's force: it goes where it wants.
  report.check("1/A small: the hand gets beyond the bar by", low.past_deg, 0.9 * (kAim_deg - kContact_deg),
               kAim_deg - kContact_deg + 0.5, "°");
  // With 8 times that the drive's limit is as strong as the hand, which stops where the slave's stiffness,
  // K_p/A, takes up its force: at a few degrees.
  report.check("1/A rises by the slave's sensor: way beyond the bar ÷ that with a small 1/A",
               by_slave.past_deg / low.past_deg, 0.02, 0.25, "");
  report.check("1/A rises by the phantom alone: way beyond the bar ÷ that with a small 1/A",
               by_phantom.past_deg / low.past_deg, 0.02, 0.25, "");
  report.check("1/A rises: the hand's torque in the end ÷ its greatest",
               std::min(by_slave.held_Nm, by_phantom.held_Nm) / hand_Nm, 0.8, 1.0, "");
  report.check("1/A rises: force on the bar in the end ÷ that with a small 1/A",
               std::max(by_slave.force_N, by_phantom.force_N) / low.force_N, 0.1, 1.02, "");
  // "Reducing it is favoured": the weight is felt all the way; friction adds to it.
  report.check("1/A small, free space: feedback ÷ the arm's weight", low.free_Nm / weight_Nm(settings), 0.95,
               1.3, "");
  report.check("1/A rises, free space: feedback ÷ that with a small 1/A",
               std::max(by_slave.free_Nm, by_phantom.free_Nm) / low.free_Nm, 0.95, 1.05, "");
  report.check("1/A great throughout, free space: feedback ÷ that with a small 1/A",
               high.free_Nm / low.free_Nm, 0.8 * kRatio, 1.2 * kRatio, "");
  report.check("by the slave's sensor: angle at which 1/A rises", by_slave.raised_deg, kContact_deg - 0.3,
               kContact_deg + 0.3, "°");
  // A sensor's voxel is in a layer if its centre is: a diagonal of voxels earlier or later, 1.1° at 45 cm.
  report.check("by the phantom: angle at which 1/A rises, from that of the innermost layer",
               by_phantom.raised_deg - innermost_layer_deg(settings), -1.1, 1.1, "°");
  report.prints_no_more("section 5.4.7 (pages 169 and 170) proposes it without figures.");
  report.difference(
      "The thesis proposes to raise 1/A where the phantom senses contact. Ours takes the innermost layer for it, of "
      "which the phantom knows before the slave touches anything: the weight is felt more in that layer. The slave's "
      "own sensor, where there is one, tells the contact itself.");
}

}  // namespace
}  // namespace in_contact_gain

Experiment contact_gain() {
  return {
      "contact-gain",
      "Feedback that stops the hand on contact",
      "section 5.4.7, items 3 and 4",
      "A small 1/A keeps an unbalanced arm's weight from the hand, but also the contact; raised on contact, which "
      "the phantom can sense, it stops the operator from moving on, and free motion stays as light.",
      {Sabotage::kLayersOffByOne, Sabotage::kWeightless, Sabotage::kSilence},
      in_contact_gain::run};
}

}  // namespace phantom::experiments
