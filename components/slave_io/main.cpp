#include <iostream>

#include "common/dds/participant.hpp"
#include "common/runtime/cell_bodies.hpp"
#include "common/runtime/deployment.hpp"
#include "common/runtime/process.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"
#include "components/slave_io/session.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  runtime::ProcessDescription description;
  description.name = "slave_io";
  description.summary =
      "The arm in the cell: position loops at 1 kHz follow the master, within the arm's limits whatever "
      "arrives. Its drives are on CAN (CiA 402), or simulated with friction, weight and contact with the "
      "objects "
      "where they really stand.";
  description.details =
      "Topics in: master_state, operator_command. Topics out: slave_state (1 kHz), component_status.\n"
      "Example: slave_io --deployment deploy/topologies/single_host.yaml\n"
      "With --report-dir it leaves slave_io.json: how the loop ran, and every contact.";
  description.run = [](const runtime::ProcessOptions& options) {
    const auto deployment = runtime::load_deployment(options);
    const auto cell = runtime::load_cell(deployment.cell);
    const auto model = slave_io::load_arm(cell, slave_io::arm_name(options.config));
    const auto config = slave_io::load_config(options.config, model.arm, model.home);
    const bool simulated = config.driver == slave_io::Driver::kSimulated;
    if (simulated) slave_io::contact_points(model, config.contact.point_pitch_m, config.contact.max_points);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      if (simulated) runtime::load_real_bodies(cell);
      std::cout << "configuration is valid\n";
      return static_cast<int>(runtime::kExitDone);
    }
    return slave_io::run_session(cell, model, config, deployment.network, options.report_dir);
  };
  return runtime::process_main(argc, argv, description);
}
