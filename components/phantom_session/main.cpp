#include <unistd.h>

#include <iostream>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/configuration/role_secrets.hpp"
#include "components/phantom_session/argument_check.hpp"
#include "components/phantom_session/first_start.hpp"
#include "components/phantom_session/session.hpp"

namespace {

/// Asks a person who named no topology what to begin with, once there is somebody to ask. Returns whether
/// that was all: the beginnings of one's own are files, to be filled in first.
bool begun_otherwise(const phantom::runtime::ProcessOptions& options) {
  using namespace phantom::phantom_session;
  if (options.deployment_named || options.check) return false;
  if (isatty(STDIN_FILENO) == 0 || isatty(STDOUT_FILENO) == 0) return false;
  const phantom::runtime::EndsAtOnce waiting;
  const FirstAnswer answer = ask_first_start(std::cin, std::cout);
  if (answer.beginning == Beginning::kDemo) return false;
  std::cout << begin_own(answer.beginning, answer.folder, phantom::runtime::share_path("deploy"))
            << std::flush;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace phantom;
  phantom_session::SessionRequest request;
  std::string operator_model, law, driver;
  runtime::ProcessDescription description;
  description.name = "phantom_session";
  description.summary =
      "Runs the processes of a topology's host as one session: "
      "starts them, tells what happens, watches that none dies, ends them in order and leaves a report.";
  description.details =
      "Without --deployment it asks on a terminal what to begin with: the demo, a cell or an arm of your own.\n"
      "Example: phantom_session --seconds 30 --report-dir report --deployment topology.yaml\n"
      "The report folder gets index.html, summary.json, plots, pictures, the sound and every process's log.";
  description.add_options = [&](runtime::Command app) {
    app.option("--seconds", request.seconds, "length of the session once all are ready; 0: until Ctrl-C")
        .between(0.0, 1e6);
    app.option("--operator", operator_model, "operator model of master_io");
    app.option("--law", law, "bilateral law of master_io");
    app.option("--driver", driver, "who moves the master: sim, or desk (a person with gamepad or joystick)");
    app.option(
        "--without", request.without,
        "a component not to start, because you run it yourself (e.g. master_io in a terminal of its own)");
  };
  description.parameters = {phantom_session::kParameters};
  description.run = [&](const runtime::ProcessOptions& given) {
    if (begun_otherwise(given)) return static_cast<int>(runtime::kExitDone);
    runtime::ProcessOptions options = given;
    if (options.report_dir.empty()) options.report_dir = "phantom-report";
    options.report_dir = std::filesystem::absolute(options.report_dir);
    if (!operator_model.empty())
      request.master_options.insert(request.master_options.end(), {"--operator", operator_model});
    if (!law.empty()) request.master_options.insert(request.master_options.end(), {"--law", law});
    if (!driver.empty()) request.master_options.insert(request.master_options.end(), {"--driver", driver});
    const auto config = phantom_session::load_config(options.config);
    const auto deployment = runtime::load_deployment(options);
    runtime::require_files(deployment);
    // A check makes nothing.
    if (!config.page_secrets.empty() && !options.check) runtime::make_role_secrets(config.page_secrets);
    if (std::filesystem::exists(config.page_secrets))
      request.page_secrets = std::filesystem::absolute(config.page_secrets);
    const bool one_host = !options.host.empty() || deployment.hosts.size() == 1;
    if (options.check && one_host) {
      if (options.host.empty()) options.host = deployment.hosts.front().name;
      phantom_session::check_all(phantom_session::plan(deployment, options, request),
                                 phantom_session::component_folder(), std::cout);
    } else if (options.check) {
      std::vector<phantom_session::PlannedProcess> all;
      for (const auto& host : deployment.hosts) {
        options.host = host.name;
        for (auto& planned : phantom_session::plan(deployment, options, request)) {
          planned.process.name = host.name + ": " + planned.process.name;
          all.push_back(std::move(planned));
        }
      }
      phantom_session::check_all(all, phantom_session::component_folder(), std::cout,
                                 phantom_session::Checked::kElsewhere);
    } else {
      const auto planned = phantom_session::plan(deployment, options, request);
      phantom_session::check_arguments(planned, phantom_session::component_folder());
    }
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) return runtime::configuration_is_valid();
    std::filesystem::create_directories(options.report_dir);
    return phantom_session::run_session(options, deployment, config, request);
  };
  return runtime::process_main(argc, argv, description);
}
