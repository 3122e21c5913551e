#include "common/runtime/operator_options.hpp"

#include "common/teleop/bilateral.hpp"

namespace phantom::runtime {
namespace {

using core::CommandKind;

void add_settings(Command command, core::OperatorRequest& request) {
  const auto gain = [&](const char* name, const char* summary, CommandKind kind) {
    Command app = command.subcommand(name, summary);
    app.option("VALUE", request.value, "the gain, 0 or more; master_io refuses what is not stable")
        .required()
        .not_negative();
    app.option("--joint", request.joint_name, "of this joint alone, by its name; default: of all");
    app.on_use([&request, kind] { request.kind = kind; });
  };
  gain("percept-gain", "set G: how strongly the drag is felt", CommandKind::kSetPerceptGain);
  gain("feedback-gain", "set 1/A: how strongly the slave's torque is felt", CommandKind::kSetFeedbackGain);

  Command law = command.subcommand("law", "change the bilateral law; 1/A becomes the law's own");
  law.option(
         "NAME",
         [&request](const std::string& name) {
           request.value =
               static_cast<double>(teleop::law_from_name(name).value_or(teleop::BilateralLaw::kPf));
         },
         "pf (a), sctfb (b), pfff (c), pe (d) or peff (e) of Table 5.1")
      .required()
      .one_of({"pf", "sctfb", "pfff", "pe", "peff"});
  law.on_use([&request] { request.kind = CommandKind::kSetLaw; });

  Command percept = command.subcommand("percept", "switch the haptic percept on or off");
  percept
      .option(
          "STATE", [&request](const std::string& state) { request.value = state == "on" ? 1.0 : 0.0; },
          "on or off")
      .required()
      .one_of({"on", "off"});
  percept.on_use([&request] { request.kind = CommandKind::kEnablePercept; });
}

}  // namespace

void add_operator_options(Command command, core::OperatorRequest& request, bool settings) {
  command
      .option("--timeout-s", request.timeout_s, "how long to wait until master and slave have confirmed it")
      .between(0.1, 3600.0);
  const auto sub = [&](const char* name, const char* summary, std::optional<CommandKind> kind) {
    command.subcommand(name, summary).on_use([&request, kind] { request.kind = kind; });
  };
  sub("status", "show how master and slave are, and which stops are in force", {});
  sub("stop", "emergency stop of master and slave; reports who has stopped, and who has not within 0.3 s",
      CommandKind::kEmergencyStop);
  sub("reset", "release the stops that are in force now", CommandKind::kReset);
  sub("home", "home the arm's drives whose encoders are not absolute, one after the other; any stop ends it",
      CommandKind::kHome);
  if (settings) add_settings(command, request);
  command.require_subcommand(1, 1);
}

}  // namespace phantom::runtime
