#include "common/runtime/configuration/operator_options.hpp"

#include <memory>

#include "common/teleop/coupling/bilateral.hpp"
#include "common/teleop/rendering/percept_set.hpp"

namespace phantom::runtime {
namespace {

using teleop::CommandKind;

void add_settings(Command command, teleop::OperatorRequest& request) {
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

  const auto on_off = [&](const char* name, const char* summary, CommandKind kind) {
    Command app = command.subcommand(name, summary);
    app.option(
           "STATE", [&request](const std::string& state) { request.value = state == "on" ? 1.0 : 0.0; },
           "on or off")
        .required()
        .one_of({"on", "off"});
    app.on_use([&request, kind] { request.kind = kind; });
  };
  on_off("percept", "switch the haptic percept, drag, on or off", CommandKind::kEnablePercept);
  on_off("counterbalance", "let the arm's gravity model carry its weight, so that it is not felt",
         CommandKind::kCounterbalance);

  Command percepts = command.subcommand("percepts", "choose the percepts: a column of Table 6.1");
  percepts
      .option(
          "NAMES",
          [&request](const std::string& names) {
            request.value = teleop::percepts_from_name(names).value_or(teleop::kAllPercepts);
          },
          teleop::kPerceptNames)
      .required()
      .accepted_by([](const std::string& names) {
        return teleop::percepts_from_name(names) ? "" : names + " is none; allowed: " + teleop::kPerceptNames;
      });
  percepts.on_use([&request] { request.kind = CommandKind::kSetPercepts; });
}

// People speak of a gripper's width in millimetres.
void add_gripper(Command command, teleop::OperatorRequest& request) {
  Command gripper = command.subcommand("gripper", "open, close or press with the slave's gripper");
  const auto force_too = [&request](Command app) {
    app.option("--force-N", request.gripper_force_N, "greatest force from now on; left out: as it is");
  };
  const auto to = [&](const char* name, const char* summary, double width_m) {
    Command app = gripper.subcommand(name, summary);
    force_too(app);
    app.on_use([&request, width_m] {
      request.kind = CommandKind::kGripperWidth;
      request.value = width_m;
    });
  };
  to("open", "as wide as it opens", 1.0);
  to("close", "until the fingers meet, or hold something", 0.0);
  Command width = gripper.subcommand("width", "to a width in mm");
  const auto width_mm = std::make_shared<double>(0.0);
  width.option("MM", *width_mm, "between the pads of its fingers").required().between(0.0, 1000.0);
  force_too(width);
  width.on_use([&request, width_mm] {
    request.kind = CommandKind::kGripperWidth;
    request.value = *width_mm * 1e-3;
  });
  Command force = gripper.subcommand("force", "set its greatest force, also while it holds something");
  force.option("N", request.value, "on each finger; slave_io says what is allowed").required().not_negative();
  force.on_use([&request] { request.kind = CommandKind::kGripperForce; });
  gripper.require_subcommand(1, 1);
}

}  // namespace

void add_operator_options(Command command, teleop::OperatorRequest& request, bool settings) {
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
  add_gripper(command, request);
  sub("tare", "take what the arm's wrist sensor shows now as no force; the arm must rest and touch nothing",
      CommandKind::kTareForceSensor);
  if (settings) add_settings(command, request);
  command.require_subcommand(1, 1);
}

}  // namespace phantom::runtime
