// The thesis's joystick AJS renders what the point robot of mpc-steps meets: command, torque and force on the
// hand, for constant, rising and falling speeds and for each coding of the gaps (thesis 3.1.3–3.1.7, D.3).

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/can/axis_units.hpp"
#include "common/runtime/cell/arm_file.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "components/master_io/session.hpp"
#include "tests/experiments/percept/mpc_rig.hpp"

namespace phantom::experiments {
namespace in_joystick {
namespace {

using mpc::Approach;

constexpr double kLever_m = 0.075;  // "for a nominal holding position at 75mm from the AJS shaft" (3.1.5 c)
constexpr double kStrong_m_per_s = 0.3;  // "for speeds above 0.3 m/sec. force was high enough" (3.1.7)
// What a hand tells apart: a force that is 7 % greater [Pang, Tan and Durlach 1991].
constexpr double kWeberFraction = 0.07;

/// One axis of the joystick as the product is shipped for it, and what the thesis prints of it.
struct Axis {
  const char* name;
  std::size_t master_joint;
  can::AxisUnits by_current, by_voltage;
  double power_W, torque_Nm;           // D.3, page 51
  double normal_V, high_V, overdrive;  // table 3.1: at 100 %, and the overdrive at the greatest voltage
  const char* motor;
};

std::vector<Axis> axes() {
  const auto by_current = [](double constant_Nm_per_A, double current_A) {
    return can::AxisUnits{.counts_per_turn = 10000.0,
                          .torque_constant_Nm_per_A = constant_Nm_per_A,
                          .rated_current_A = current_A};
  };
  const auto by_voltage = [](double torque_Nm, double rated_V) {
    return can::AxisUnits{.counts_per_turn = 10000.0,
                          .torque_sensitivity_Nm_per_V = torque_Nm / rated_V,
                          .rated_voltage_V = rated_V};
  };
  return {{"theta", 0, by_current(0.36, 0.9), by_voltage(0.32, 3.6), 100.0, 0.32, 3.6, 8.0, 2.5, "M1"},
          {"phi", 1, by_current(0.49, 2.6), by_voltage(1.27, 3.8), 400.0, 1.27, 3.8, 7.0, 2.0, "M2"}};
}

/// Torque in N·m of a command in V, by the drive's own thousandths of its rated torque.
double torque_of(const can::AxisUnits& units, double command_V) {
  return units.torque(static_cast<std::int16_t>(std::lround(1e3 * command_V / units.rated_voltage_V)));
}

/// The joystick, with the shipped mapping onto x and y of the Cartesian robot.
struct Joystick {
  explicit Joystick(const Settings& settings) {
    const auto deploy = settings.source_dir / "deploy";
    const auto cell = runtime::load_cell(deploy / "cells/joystick_bench/cell.yaml");
    const auto robot = master_io::load_arm(cell, "");
    config = master_io::load_config(deploy / "cells/joystick_bench/master_io.yaml", cell.file, robot.arm,
                                    robot.home, {});
    on_can =
        master_io::load_config(deploy / "can/joystick_master_io.yaml", cell.file, robot.arm, robot.home, {});
  }
  const robot::Joint& joint(const Axis& axis) const { return config.mapping->joints[axis.master_joint]; }

  master_io::Config config, on_can;
};

/// What the axis renders of an approach that its led joint makes: force_N is that on the hand.
struct Rendered {
  Approach felt;
  std::vector<double> torque_Nm, command_V;
  double off_law = 0.0;    // greatest deviation of τ from λ·RP within the limit, as a share of the limit
  double pushed_W = -1e9;  // greatest power that the hand got
};

/// `lambda_Nm_per_N`: τ = λ·RP (eq. 3.12), set by the percept's gain.
Rendered render(const Approach& approach, const Joystick& joystick, const Axis& axis, double lambda_Nm_per_N,
                const Settings& settings) {
  const master_io::MappingConfig& shipped = joystick.config.mapping.value();
  const teleop::JointMapping true_mapping(shipped.mapping),
      mapping(sabotaged(shipped.mapping, settings.sabotage));
  const teleop::LedJoint& led = true_mapping.led(axis.master_joint);
  const double limit_Nm = joystick.joint(axis).max_effort;
  teleop::PerceptParameters percept = joystick.config.percept;
  percept.torque_cap_Nm = joystick.config.device.torque_limit_Nm;  // "100% dynamic torque range"
  percept.damping_limit_Nms_per_rad.fill(1e9);  // a handle that is held renders any damping
  percept.smoothing_s = 0.0;
  teleop::PerceptRenderer renderer(percept);
  core::JointArray gain{};
  gain[led.arm_joint] = lambda_Nm_per_N / led.ratio;
  Rendered result{.felt = approach, .torque_Nm = {}, .command_V = {}};
  const double dt_s = 1.0 / mpc::kRate_Hz;
  for (int i = 0; i < 100; ++i) renderer.step({{}, true}, true, true, gain, {}, dt_s);  // fades in
  for (std::size_t i = 0; i < approach.force_N.size(); ++i) {
    teleop::DragCoefficients drag{{}, true};
    drag.plus[led.arm_joint] = drag.minus[led.arm_joint] = approach.force_N[i] / approach.speed_m_per_s[i];
    core::JointArray handle{};
    handle[axis.master_joint] =
        approach.speed_m_per_s[i] / led.ratio;  // the hand leads the robot at its speed
    const auto at_arm = renderer.step(drag, true, true, gain, mapping.arm_velocity(handle), dt_s).torque_Nm;
    const double torque_Nm = mapping.master_torque(at_arm)[axis.master_joint];
    const double lawful_Nm = -std::min(lambda_Nm_per_N * approach.force_N[i], limit_Nm);
    result.off_law = std::max(result.off_law, std::abs(torque_Nm - lawful_Nm) / limit_Nm);
    result.pushed_W = std::max(result.pushed_W, torque_Nm * handle[axis.master_joint]);
    const std::int16_t mille = axis.by_voltage.torque_mille(torque_Nm);
    result.torque_Nm.push_back(-torque_Nm);
    result.command_V.push_back(-mille * 1e-3 * axis.by_voltage.rated_voltage_V);
    result.felt.force_N[i] = -axis.by_voltage.torque(mille) / kLever_m;
  }
  return result;
}

/// Least rise of the force at a step, relative to the force before.
double least_step(const Approach& felt) {
  double least = 1e9;
  for (const std::size_t i : mpc::steps_in(felt, 0.0, mpc::kApproach_m))
    least = std::min(least, felt.force_N[i] / felt.force_N[i - 1] - 1.0);
  return least;
}

/// Share of the steps that are higher than the one before.
double rising_share(const Approach& felt) {
  const auto steps = mpc::steps_in(felt, 0.0, mpc::kApproach_m);
  std::size_t rising = 0;
  for (std::size_t k = 1; k < steps.size(); ++k) {
    const auto height = [&](std::size_t i) { return felt.force_N[i] - felt.force_N[i - 1]; };
    rising += height(steps[k]) > height(steps[k - 1]) ? 1U : 0U;
  }
  return steps.size() > 1 ? static_cast<double>(rising) / static_cast<double>(steps.size() - 1)
                          : std::nan("");
}

/// Figures 3.10 and 3.11, and the rows of table 3.1 and appendix D beside the shipped drives and limits.
void transducer(Report& report, const Joystick& joystick) {
  Plot& plot = report.plot("transducer",
                           "Command, torque and speed of the joystick's two motors; drive steps of 1 ‰", 2);
  for (const Axis& axis : axes()) {
    const std::string name = axis.name, motor = axis.motor;
    const robot::Joint& joint = joystick.joint(axis);
    Table& line = report.table(name + "_command", {"command [V]", "torque [N·m]"});
    for (int tenth = -80; tenth <= 80; ++tenth)
      line.row({0.1 * tenth, torque_of(axis.by_voltage, 0.1 * tenth)});
    Table& printed = report.table(name + "_printed", {"command [V]", "torque [N·m]"});
    printed.row({axis.normal_V, axis.torque_Nm});
    printed.row({axis.high_V, axis.overdrive * axis.torque_Nm});
    plot.panel(name + ", " + motor, "command [V]", "torque [N·m]")
        .series(line, "command [V]", "torque [N·m]", "λ · command")
        .series(printed, "command [V]", "torque [N·m]", "thesis (table 3.1)", Style::kPoints)
        .horizontal(joint.max_effort, "limit");
    const double turns_per_s = joint.max_speed / (2.0 * std::numbers::pi);
    report.beside(name + ": power at the shipped limits of torque and speed", "section 3.1.3 a, page 51",
                  axis.power_W, joint.max_effort * joint.max_speed, 0.98 * axis.power_W, 1.02 * axis.power_W,
                  "W");
    report.beside(name + ": greatest speed", "section 3.1.3 a, page 51", 50.0, turns_per_s, 49.9, 50.1,
                  "1/s");
    report.beside(name + ": rated torque, torque constant times rated current",
                  "data of the drives, appendix D", axis.torque_Nm, axis.by_current.rated_motor_torque_Nm(),
                  0.98 * axis.torque_Nm, 1.02 * axis.torque_Nm, "N·m");
    report.beside(name + ": torque at the command of normal demand", "table 3.1, page 58", 100.0,
                  100.0 * torque_of(axis.by_voltage, axis.normal_V) / joint.max_effort, 99.0, 101.0, "%");
    const double linear = 100.0 * axis.high_V / axis.normal_V;
    report.beside(name + ": torque at the greatest command of table 3.1", "table 3.1, page 58",
                  100.0 * axis.overdrive, 100.0 * torque_of(axis.by_voltage, axis.high_V) / joint.max_effort,
                  0.99 * linear, 1.01 * linear, "%");
    const can::AxisUnits& shipped = joystick.on_can.can->group.axes[axis.master_joint].units;
    report.check(name + ": shipped drive on CAN: rated torque ÷ the joystick's limit",
                 shipped.rated_motor_torque_Nm() / joint.max_effort, 0.98, 1.02, "");
  }
  report.difference(
      "Table 3.1 prints 250 % torque at 8 V beside 100 % at 3.6 V (M1), and 200 % at 7 V beside 100 % at 3.8 V (M2). One λ gives 222 % and "
      "184 %: the bands lie round these, as page 52 states a very good linearity. Ours renders the continuous torque at most, "
      "so the overdrive is not used.");
}

/// A plate with one coding of the gaps, and the λ that gives 100 % torque at kStrong_m_per_s in its innermost
/// layer.
struct Approached {
  Approached(const mpc::Coding& coding, const Settings& settings)
      : cylinder(mpc::design(coding.gaps_vox)),
        layered(mpc::plate(cylinder, mpc::kCubes, settings)),
        greatest_RP_N(kStrong_m_per_s *
                      percept::mpc_gamma_at(cylinder, 0.0, percept::MpcTransition::kStepped)) {}
  Rendered by(const Axis& axis, const mpc::Motion& motion, const Joystick& joystick,
              const Settings& settings) const {
    return render(mpc::approach(layered, motion, settings), joystick, axis,
                  joystick.joint(axis).max_effort / greatest_RP_N, settings);
  }

  percept::MpcDesign cylinder;
  workspace::Workspace layered;
  double greatest_RP_N;
};

constexpr mpc::Motion kMotions[]{{"constant 0.10 m/s", 0.10, 0.10},
                                 {"constant 0.20 m/s", 0.20, 0.20},
                                 {"accelerating 0.02 → 0.18 m/s", 0.02, 0.18},
                                 {"decelerating 0.18 → 0.02 m/s", 0.18, 0.02}};
constexpr mpc::Motion kFast[]{{"constant 0.30 m/s", kStrong_m_per_s, kStrong_m_per_s},
                              {"constant 0.45 m/s", 1.5 * kStrong_m_per_s, 1.5 * kStrong_m_per_s}};

/// What both axes owe for every coding and motion.
void transduction(Report& report, const Joystick& joystick, const Settings& settings) {
  double off_law = 0.0, pushed_W = -1e9, by_speed = 0.0;
  for (const mpc::Coding& coding : mpc::codings()) {
    const Approached plate(coding, settings);
    for (const Axis& axis : axes()) {
      std::vector<double> greatest_N;
      for (const mpc::Motion& motion : kMotions) {
        const Rendered felt = plate.by(axis, motion, joystick, settings);
        off_law = std::max(off_law, felt.off_law);
        pushed_W = std::max(pushed_W, felt.pushed_W);
        greatest_N.push_back(mpc::greatest(felt.felt.force_N));
      }
      by_speed = std::max(by_speed, std::abs(greatest_N[1] / greatest_N[0] - 2.0));
    }
  }
  report.check("τ = λ·RP within the motors' limits: greatest deviation, share of the limit", off_law, 0.0,
               1e-6, "");
  report.check("greatest power that the hand gets from the joystick", pushed_W, -1e9, 1e-12, "W");
  report.check("force ∝ speed: deviation of F(2v)/F(v) on the hand from 2", by_speed, 0.0, 0.02, "");
  const Approached plate(mpc::codings()[0], settings);
  for (const Axis& axis : axes()) {
    const double limit_N = joystick.joint(axis).max_effort / kLever_m;
    for (const mpc::Motion& motion : kFast)
      report.check(std::string(axis.name) + ": greatest force on the hand at 75 mm, " + motion.name,
                   mpc::greatest(plate.by(axis, motion, joystick, settings).felt.force_N), 0.995 * limit_N,
                   1.001 * limit_N, "N");
  }
}

/// Figures 3.15 and 3.16: the force on the hand along the approach, and its steps, of theta.
void steps_on_the_hand(Report& report, const Joystick& joystick, const Settings& settings) {
  const Axis theta = axes().front();
  Plot& plot = report.plot("hand_force",
                           "Force on the hand 75 mm from theta's axis while the robot approaches over 10 cm\n"
                           "λ: 100 % torque at 0.3 m/s in the innermost layer; drive steps of 1 ‰, 100 Hz",
                           3);
  for (const mpc::Coding& coding : mpc::codings()) {
    const Approached plate(coding, settings);
    Panel& panel = plot.panel(coding.name, "fraction of x = 10 cm travelled", "force on the hand [N]");
    for (const mpc::Motion& motion : kMotions) {
      const Rendered felt = plate.by(theta, motion, joystick, settings);
      Table& table = report.table(std::string(coding.table) + "_" + std::to_string(&motion - kMotions),
                                  {"fraction of x", "command [V]", "torque [N·m]", "force [N]"});
      for (std::size_t i = 0; i < felt.torque_Nm.size(); ++i)
        table.row({felt.felt.travel_m[i] / mpc::kApproach_m, felt.command_V[i], felt.torque_Nm[i],
                   felt.felt.force_N[i]});
      panel.series(table, "fraction of x", "force [N]", motion.name, Style::kStep);
    }
    const Approach slow = plate.by(theta, kMotions[0], joystick, settings).felt;
    if (coding.gaps_vox.front() == 2) {
      report.check("theta: least step on the hand, k = 2, share of the force before; a hand feels 0.07",
                   least_step(slow), kWeberFraction, 1.0, "");
      report.check("theta: share of the steps that are higher than the one before, k = 2", rising_share(slow),
                   1.0, 1.0, "");
    }
    if (coding.gaps_vox.front() != coding.gaps_vox.back()) {
      const double rise = mpc::steps_per_s(slow, 0.5 * mpc::kApproach_m, mpc::kApproach_m) /
                          mpc::steps_per_s(slow, 0.0, 0.5 * mpc::kApproach_m);
      report.beside("steps a second on the hand near the plate over those far out, k = 2, then 1",
                    "figure 3.16 c, page 56", 2.0, rise, 1.9, 2.1, "");
    }
  }
}

void run(Report& report, const Settings& settings) {
  const Joystick joystick(settings);
  transduction(report, joystick, settings);
  steps_on_the_hand(report, joystick, settings);
  transducer(report, joystick);
  report.prints_no_more(
      "figures 3.10, 3.11 and 3.13–3.16 (pages 52–56) show curves without values that can be read; the thesis prints neither λ nor a force. "
      "Table 3.2 (page 64) is of computing loads: filter-cost has it. 75 mm, 100 % dynamic torque range and 0.3 m/s are from pages 55 "
      "and 57.");
  report.difference(
      "In figure 3.12 b the robot moves by its controller and the handle is held. Here the hand leads the robot at that speed, because the "
      "product's drag answers the master's own velocity; in the arm's coordinates the two speeds are the same.");
}

}  // namespace
}  // namespace in_joystick

Experiment joystick() {
  return {
      "joystick",
      "The joystick AJS as transducer",
      "figures 3.10–3.16, table 3.1, appendix D",
      "τ = λ·RP: the joystick's torque is proportional to the response parameter, within its motors' limits, "
      "and the hand at 75 mm feels steps that grow towards the object and with speed.",
      {Sabotage::kConstantMu, Sabotage::kIgnoredSpeed, Sabotage::kGrownBodies, Sabotage::kUnitRatio},
      in_joystick::run};
}

}  // namespace phantom::experiments
