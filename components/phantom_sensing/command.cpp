#include "components/phantom_sensing/command.hpp"

#include <spdlog/fmt/fmt.h>

#include <ostream>

#include "common/core/errors.hpp"
#include "common/messages/ask.hpp"
#include "common/runtime/process/process.hpp"

namespace phantom::phantom_sensing {
namespace {

messages::SensingCommand command_for(const CommandRequest& arguments) {
  using messages::SensingRequest;
  if (arguments.what == "self-test") return {.request = SensingRequest::kSelfTest};
  if (arguments.what == "list") return {.request = SensingRequest::kListContacts};
  const bool allow = arguments.what == "allow";
  const int named =
      (arguments.object.empty() ? 0 : 1) + (arguments.id != 0 ? 1 : 0) + (arguments.all ? 1 : 0);
  if (named != 1) {
    throw core::ConfigError("command " + arguments.what + ": exactly one of --object" +
                            (allow ? " and --id" : ", --id and --all") + " must be given");
  }
  if (arguments.all && !arguments.link.empty())
    throw core::ConfigError("command forbid: --link: does not go with --all; name the object instead");
  return {.request = allow ? SensingRequest::kAllowContact : SensingRequest::kForbidContact,
          .object = arguments.object,
          .id = static_cast<std::uint16_t>(arguments.id),
          .link = arguments.link,
          .duration_s = arguments.duration_s};
}

}  // namespace

void add_options(runtime::Command command, CommandRequest& arguments) {
  command.option("--timeout-s", arguments.timeout_s, "how long to wait for the answer").between(0.1, 3600.0);
  const auto sub = [&](const char* name, const char* summary) {
    runtime::Command app = command.subcommand(name, summary);
    app.on_use([&arguments, name] { arguments.what = name; });
    return app;
  };
  const auto add_contact = [&arguments](runtime::Command app) {
    app.option("--object", arguments.object, "the object's name");
    app.option("--id", arguments.id, "its id, instead of the name").between(1, 65534);
    app.option("--link", arguments.link, "link or frame of the arm; default: the whole arm");
  };
  runtime::Command allow =
      sub("allow", "an object may be touched: its fluid is neither felt nor warned of there");
  add_contact(allow);
  allow.option("--for-s", arguments.duration_s, "for so long; default: until it is forbidden")
      .between(0.001, 86400.0);
  runtime::Command forbid = sub("forbid", "take that back: the object is felt again");
  add_contact(forbid);
  forbid.flag("--all", arguments.all, "all that was allowed");
  sub("list", "list the contacts that are allowed");
  sub("self-test", "dip a virtual probe into every layer of every object, and report the result");
  command.require_subcommand(1, 1);
}

int run_command(const CommandRequest& arguments, const core::NetworkOptions& network, std::ostream& print) {
  const auto reply =
      messages::ask(network, "phantom_sensing_command", command_for(arguments), arguments.timeout_s);
  if (!reply) {
    print << fmt::format(
        "no answer from phantom_sensing in domain {} for {} s; is it running, and is this its deployment?\n",
        network.domain, arguments.timeout_s);
    return runtime::kExitMissing;
  }
  const bool tested = arguments.what == "self-test";
  print << (reply->done ? "done: " : tested ? "failed: " : "refused: ") << reply->message << '\n';
  return reply->done ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::phantom_sensing
