#pragma once

#include <memory>

#include "common/core/clock.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/master_io/config.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"
#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

inline constexpr double kKgcm_Nm = 0.0980665;  // the thesis gives torques in kg·cm

/// Everything that the thesis's rig of chapter 5 is made of, as the product reads it from its files. What an
/// experiment changes of it, it changes here.
struct TeleopSetup {
  runtime::CellConfig cell;  ///< cells/bar, as modelled; where the bar really stands: its X_deviation
  slave_io::ArmModel arm;    ///< the test arm; its link touches along its axis
  phantom_sensing::PhantomModel phantom;  ///< 60 sensors along the link
  master_io::Config master;        ///< shipped, with a light master joint: hardly any friction (figure 5.22)
  slave_io::Config slave;          ///< shipped
  workspace::Workspace workspace;  ///< of the cell
  std::size_t joint = 1;           ///< that swings and is measured: theta of the test arm
};

/// `operator_model` and `law` as on master_io's command line. Profile and speeds are sabotaged as the
/// settings say.
TeleopSetup teleop_setup(const Settings& settings, const std::string& operator_model, const std::string& law);

/// The same with another cell's arm and its phantom, whose `joint` the experiment names.
TeleopSetup teleop_setup_of(runtime::CellConfig cell, phantom_sensing::PhantomModel phantom,
                            const Settings& settings, const std::string& operator_model,
                            const std::string& law);

/// Clamps the percept's torque on theta.
void clamp_percept(TeleopSetup& setup, double cap_Nm);
inline constexpr double kThesisClamp_Nm = 2.2 * kKgcm_Nm;  // figure 5.24

/// The swing that the operator makes: the joint from `from_rad`, where both arms start, to `to_rad` in
/// `duration_s`, and the hand stays there.
void set_swing(TeleopSetup& setup, double to_rad, double duration_s, double from_rad = 0.0);

/// What was measured in one period.
struct Moment {
  double t_s = 0.0;
  double master_rad = 0.0, master_rad_s = 0.0;  ///< the joint of the master, as its encoders say
  double slave_rad = 0.0, slave_rad_s = 0.0;
  double reference_rad = 0.0;  ///< what the slave's position loop follows
  double mlt_Nm = 0.0;         ///< torque of the hand or of the velocity servo on the master (MLT)
  double pffb_Nm = 0.0;        ///< phantom's feedback, positive against the motion (PFFB)
  double sffb_Nm = 0.0;        ///< slave's feedback on the master, likewise (SCTFB for the law of that name)
  double loop_Nm = 0.0;        ///< torque of the slave's position loop
  double inverse_a = 0.0;      ///< 1/A in force, the least of all joints
  double mu = 0.0;             ///< greatest of the phantom's sensors, Pa·s/m
  bool contact = false;        ///< the slave touches the real bar
  double force_N = 0.0;
  bool swinging = false;  ///< the operator is on the way in, or stays at its end
  bool percept = false;   ///< the percept is on
  bool masked = false;    ///< the product tells that the slave's feedback masks the drag
};

/// The servo threads' work of master_io and slave_io and the step of phantom_sensing, tick by tick on a
/// simulated clock; a sample made in one tick is heard in the next. No DDS, no threads.
class TeleopRig {
 public:
  /// `setup` must outlive it.
  TeleopRig(const TeleopSetup& setup, const Settings& settings);
  ~TeleopRig();
  /// One millisecond.
  const Moment& step();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace phantom::experiments
