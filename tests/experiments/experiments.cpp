#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

// One function per experiment, in a file of its own name.
Experiment mpc_steps();
Experiment filter_cost();
Experiment triangulation();
Experiment search_scope();
Experiment voxelise();
Experiment ranked_layers();
Experiment layer_sections();
Experiment rejected_shells();
Experiment drag_tracks();
Experiment speed();
Experiment smoothing();
Experiment merge();
Experiment pgd();
// arms and what is built on them
Experiment joystick();
Experiment arm_sensors();
Experiment sensing_models();
Experiment lean_sensors();
Experiment pffb_speed();
Experiment coworking();
Experiment btm_cases();
Experiment percept_sets();
Experiment contact_gain();
Experiment enhanced();
Experiment aid_views();
Experiment hit_view();
Experiment lead_time();
Experiment audio();
Experiment model_error();
Experiment survey_fit();
Experiment touch();
Experiment submerged();
Experiment palpation();
Experiment resolutions();
Experiment shared_skin();
Experiment arm_pair();
Experiment scara();
// the executables as they are shipped
Experiment running_system();

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all{
      mpc_steps(),
      filter_cost(),
      triangulation(),
      search_scope(),
      voxelise(),
      ranked_layers(),
      layer_sections(),
      rejected_shells(),
      drag_tracks(),
      speed(),
      smoothing(),
      merge(),
      // arms and what is built on them
      joystick(),
      arm_sensors(),
      sensing_models(),
      lean_sensors(),
      pffb_speed(),
      coworking(),
      btm_cases(),
      percept_sets(),
      contact_gain(),
      enhanced(),
      pgd(),
      aid_views(),
      hit_view(),
      lead_time(),
      audio(),
      model_error(),
      survey_fit(),
      touch(),
      submerged(),
      palpation(),
      resolutions(),
      shared_skin(),
      arm_pair(),
      scara(),
      // the executables as they are shipped
      running_system(),
  };
  return all;
}

}  // namespace phantom::experiments
