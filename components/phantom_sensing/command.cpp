#include "components/phantom_sensing/command.hpp"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <ostream>

#include "common/runtime/process.hpp"
#include "components/phantom_sensing/dds_adapter_client.hpp"

namespace phantom::phantom_sensing {
namespace {

SensingWish wish_for(const CommandRequest& request) {
  SensingWish wish;
  if (request.what == "self-test") return wish;
  if (request.what == "list") {
    wish.what = SensingWish::What::kListContacts;
    return wish;
  }
  wish.what = SensingWish::What::kContact;
  const int named = (request.object.empty() ? 0 : 1) + (request.id != 0 ? 1 : 0) + (request.all ? 1 : 0);
  if (named != 1) {
    throw core::ConfigError("command " + request.what + ": exactly one of --object" +
                            (request.what == "forbid" ? ", --id and --all" : " and --id") + " must be given");
  }
  if (request.all && !request.link.empty())
    throw core::ConfigError("command forbid: --link: does not go with --all; name the object instead");
  wish.contact = {request.what == "allow", request.object, static_cast<std::uint16_t>(request.id),
                  request.link, request.duration_s};
  return wish;
}

}  // namespace

void add_options(CLI::App& command, CommandRequest& request) {
  command.add_option("--timeout-s", request.timeout_s, "how long to wait for the answer")
      ->check(CLI::Range(0.1, 3600.0));
  const auto sub = [&](const char* name, const char* summary) {
    CLI::App* app = command.add_subcommand(name, summary);
    app->fallthrough();
    app->callback([&request, name] { request.what = name; });
    return app;
  };
  const auto add_contact = [&request](CLI::App& app) {
    app.add_option("--object", request.object, "the object's name");
    app.add_option("--id", request.id, "its id, instead of the name")->check(CLI::Range(1, 65534));
    app.add_option("--link", request.link, "link or frame of the arm; default: the whole arm");
  };
  CLI::App* allow = sub("allow", "an object may be touched: its fluid is neither felt nor warned of there");
  add_contact(*allow);
  allow->add_option("--for-s", request.duration_s, "for so long; default: until it is forbidden")
      ->check(CLI::Range(0.001, 86400.0));
  CLI::App* forbid = sub("forbid", "take that back: the object is felt again");
  add_contact(*forbid);
  forbid->add_flag("--all", request.all, "all that was allowed");
  sub("list", "tell which contacts are allowed");
  sub("self-test", "dip a virtual probe into every layer of every object, and say what came of it");
  command.require_subcommand(1);
}

int run_command(const CommandRequest& request, const core::NetworkOptions& network, std::ostream& print) {
  const SensingWish wish = wish_for(request);
  const auto answer = CommandClient(network).ask(wish, request.timeout_s);
  if (!answer) {
    print << fmt::format(
        "no word from a phantom_sensing in domain {} for {} s; is it running, and is this its deployment?\n",
        network.domain, request.timeout_s);
    return runtime::kExitMissing;
  }
  const bool tested = request.what == "self-test";
  print << (answer->done ? "done: " : tested ? "failed: " : "refused: ") << answer->message << '\n';
  return answer->done ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::phantom_sensing
