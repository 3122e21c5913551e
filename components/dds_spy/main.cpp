#include <iostream>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/observation/observer.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_spy/session.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  dds_spy::Request request;
  runtime::ProcessDescription description;
  description.name = "dds_spy";
  description.summary =
      "Shows a DDS domain: its participants, what they send, how often, how evenly, how old, "
      "what is lost, and why two endpoints do not communicate. It only observes.";
  description.details = dds_spy::help_text();
  description.add_options = [&](runtime::Command app) { dds_spy::add_options(app, request); };
  description.parameters = {dds_spy::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    if (request.ask_types && !observation::can_ask_for_types())
      throw core::ConfigError(
          "--ask-types: this Fast DDS cannot ask for a type's description; version 3 can (Debian 13)");
    const auto config = dds_spy::load_config(options.config);
    const auto deployment = runtime::load_deployment(options);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) return runtime::configuration_is_valid();
    return dds_spy::run(request, config, deployment.network, std::cout);
  };
  return runtime::process_main(argc, argv, description);
}
