#include "tests/experiments/arms/teleop_rig.hpp"

#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/simulation/mesh_world.hpp"
#include "components/master_io/servo.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "tests/experiments/arms/bar_rig.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace {

constexpr core::Nanoseconds kTick_ns = core::kNsPerMillisecond;
constexpr double kTick_s = 0.001;
constexpr std::uint64_t kMasterSession = 1, kSlaveSession = 2;
constexpr int kSensors = 60;

/// The simulated master device; speeds are sabotaged on their way to the controller.
class Device final : public master_io::Device {
 public:
  Device(const master_io::Config& config, const core::JointArray& start_q, Sabotage sabotage)
      : device_(config, start_q), sabotage_(sabotage) {}
  const master_io::DeviceSense& sense(core::Nanoseconds now_ns) noexcept override {
    sense_ = device_.sense(now_ns);
    sense_.velocity = sabotaged(sense_.velocity, sabotage_);
    return sense_;
  }
  void move(const master_io::DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept override {
    device_.move(demand, dt_s, now_ns);
  }
  void end(core::Nanoseconds now_ns) noexcept override { device_.end(now_ns); }
  bool makes_up_periods() const noexcept override { return true; }
  core::ActuatorHealth health() override { return {}; }

 private:
  master_io::SimulatedDevice device_;
  Sabotage sabotage_;
  master_io::DeviceSense sense_;
};

/// The slave as configured; or an arm without weight.
slave_io::Config sabotaged(slave_io::Config slave, Sabotage sabotage) {
  if (sabotage == Sabotage::kWeightless) slave.plant.balanced = true;
  return slave;
}

/// Nobody stops an experiment.
class NoStops final : public teleop::StopStore {
 public:
  teleop::StopRecord read() const noexcept override { return {}; }
  void write(const teleop::StopRecord&) noexcept override {}
};

}  // namespace

TeleopSetup teleop_setup_of(runtime::CellConfig cell, phantom_sensing::PhantomModel phantom,
                            const Settings& settings, const std::string& operator_model,
                            const std::string& law) {
  auto arm = slave_io::load_arm(cell, "");
  auto master = master_io::load_config(
      settings.source_dir / "components/master_io/master_io.yaml", cell.file, arm.arm, arm.home,
      {.operator_model = operator_model, .law = law, .driver = "", .desk_device = ""});
  auto slave =
      slave_io::load_config(settings.source_dir / "components/slave_io/slave_io.yaml", arm.arm, arm.home);
  master.measure_bare_loop = false;
  for (std::size_t j = 0; j < arm.arm.joint_count(); ++j) {
    master.device.joints[j].coulomb = 0.001;
    master.device.joints[j].viscous = 0.001;
  }
  master.script.percept = simulation::PerceptSchedule::kOn;
  master.script.duration_scatter = master.script.overreach = 0.0;
  master.script.reaction_s = 1e6;  // nobody lets go at contact
  slave.contact.point_pitch_m = 0.005;
  slave.contact_limit.torque_Nm = {};  // the thesis's rig bounds no force of contact
  auto workspace = phantom_sensing::build_workspace(cell);
  return {std::move(cell),   std::move(arm),   std::move(phantom),
          std::move(master), std::move(slave), std::move(workspace)};
}

TeleopSetup teleop_setup(const Settings& settings, const std::string& operator_model,
                         const std::string& law) {
  auto cell = bar_cell(settings);
  auto phantom = axis_phantom(cell, kSensors, robot::Normalisation::kArea);
  TeleopSetup setup = teleop_setup_of(std::move(cell), std::move(phantom), settings, operator_model, law);
  robot::AxisSensors axis;
  axis.from_m = {-kLink_m, 0.0, 0.0};
  setup.arm.skin = {{.link = "link_under_test", .segments = {}, .axes = {axis}, .meshes = {}}};
  setup.joint = kTheta;
  return setup;
}

void clamp_percept(TeleopSetup& setup, double cap_Nm) { setup.master.percept.torque_cap_Nm[kTheta] = cap_Nm; }

void set_swing(TeleopSetup& setup, double to_rad, double duration_s, double from_rad) {
  auto& script = setup.master.script;
  setup.arm.home[setup.joint] = script.reaches.front().from[setup.joint] = from_rad;
  script.reaches.front().target[setup.joint] = to_rad;
  script.in_s = duration_s;
  script.hold_s = 1e6;
  script.patience = 1e6;
}

struct TeleopRig::Parts {
  const TeleopSetup& setup;
  Sabotage sabotage;
  simulation::MeshWorld world;
  master_io::Inbox master_inbox;
  slave_io::Inbox slave_inbox;
  Device device;
  slave_io::SimulatedArm arm;
  NoStops stops;
  master_io::Servo master;
  slave_io::Servo slave;
  phantom_sensing::PhantomSensing phantom;
  phantom_sensing::SensedWorkspace workspace;
  core::Nanoseconds now_ns = core::kNsPerSecond;
  std::uint64_t ticks = 0;
  master_io::MasterReport master_output;
  slave_io::SlaveReport slave_output;
  Moment moment;

  Parts(const TeleopSetup& s, const Settings& settings)
      : setup(s),
        sabotage(settings.sabotage),
        world(runtime::load_real_bodies(s.cell), s.slave.contact.clearance_range_m),
        device(s.master, s.arm.home, settings.sabotage),
        arm(s.arm, sabotaged(s.slave, settings.sabotage), world),
        master(s.master, s.arm.home, device, master_inbox, kMasterSession, stops),
        slave(s.arm, s.slave, arm, slave_inbox, kSlaveSession, stops),
        phantom(s.phantom, {}),
        workspace{&s.workspace, percept::greatest_neighbour_mu(s.workspace)} {}

  void tick_master() {
    master.tick(kTick_s, now_ns);
    master.outbox.read(master_output);
    master_output.stamp = {ticks, now_ns, kMasterSession};
    slave_inbox.master.write({master_output, master_output.slave_echo, now_ns, kSlaveSession});
  }
  void tick_slave() {
    slave.tick(kTick_s, now_ns);
    slave.outbox.read(slave_output);
    slave_output.stamp = {ticks, now_ns, kSlaveSession};
    master_inbox.slave.write({slave_output, slave_output.master_echo, now_ns, kMasterSession});
  }
  void tick_phantom() {
    phantom_sensing::StepInputs in;
    in.position = slave_output.position;
    in.velocity = sabotaged(slave_output.velocity, sabotage);
    in.dt_s = kTick_s;
    in.workspace = workspace;
    in.state_valid = true;
    phantom_sensing::StepOutputs out;
    phantom.step(in, out);
    moment.mu = out.worst.mu;
    if (sabotage != Sabotage::kSilence)
      master_inbox.phantom.write({.received_ns = now_ns,
                                  .contact = out.worst.closeness >= 1.0,
                                  .closeness = out.percept.closeness,
                                  .threat_closeness = out.threats.empty() ? 0.0 : out.threats[0].closeness});
    master_io::DragSample drag;
    drag.received_ns = now_ns;
    drag.answers_ns = slave_output.master_echo.monotonic_ns;
    drag.drag = {out.drag, out.valid};
    master_inbox.drag.write(drag);
  }
  void note() {
    moment.t_s += kTick_s;
    moment.master_rad = master_output.position[setup.joint];
    moment.master_rad_s = master_output.velocity[setup.joint];
    moment.slave_rad = slave_output.position[setup.joint];
    moment.slave_rad_s = slave_output.velocity[setup.joint];
    moment.reference_rad = slave_output.outputs.reference[setup.joint];
    moment.mlt_Nm = master_output.operator_torque_Nm[setup.joint];
    moment.pffb_Nm = -master_output.percept_torque_Nm[setup.joint];
    moment.sffb_Nm = -master_output.feedback_torque_Nm[setup.joint];
    moment.loop_Nm = slave_output.outputs.torque.loop_Nm[setup.joint];
    moment.inverse_a = master_output.feedback_gain;
    moment.contact = slave_output.contact;
    moment.force_N = slave_output.contact_force_N;
    moment.swinging = master_output.reach >= 0;
    moment.percept = master_output.percept_enabled;
    moment.masked = master_output.outputs.drag_masked;
  }
};

TeleopRig::TeleopRig(const TeleopSetup& setup, const Settings& settings)
    : parts_(std::make_unique<Parts>(setup, settings)) {}
TeleopRig::~TeleopRig() = default;

const Moment& TeleopRig::step() {
  Parts& p = *parts_;
  p.now_ns += kTick_ns;
  ++p.ticks;
  p.tick_master();
  p.tick_slave();
  p.tick_phantom();
  p.note();
  return p.moment;
}

}  // namespace phantom::experiments
