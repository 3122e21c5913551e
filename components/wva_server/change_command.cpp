#include "components/wva_server/change_command.hpp"

#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/core/errors.hpp"
#include "common/messages/ask.hpp"
#include "common/runtime/configuration/pose_text.hpp"
#include "common/runtime/process/process.hpp"
#include "components/wva_server/dds_adapter_client.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {
namespace {

using core::ConfigError;
using core::MissingError;
using messages::WorkspaceCommand;
using messages::WorkspaceOperation;

std::string text_of(const std::string& file) {
  constexpr std::size_t kMaxBytes = 1 << 20;  // bytes; far more than a command may hold
  std::ifstream stream(file);
  std::istream& from = file == "-" ? std::cin : stream;
  std::string text(kMaxBytes, '\0');
  from.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (from.bad() || (file != "-" && (!stream.is_open() || std::filesystem::is_directory(file))))
    throw MissingError("command add: --file: " + file + " cannot be read");
  if (!from.eof())
    throw ConfigError("command add: --file: " + file + " has more than 1 MiB; allowed: 16 KiB");
  text.resize(static_cast<std::size_t>(from.gcount()));
  return text;
}

WorkspaceOperation operation_of(const std::string& what) {
  for (const auto operation :
       {WorkspaceOperation::kMove, WorkspaceOperation::kAttach, WorkspaceOperation::kRelease,
        WorkspaceOperation::kName, WorkspaceOperation::kFreeze, WorkspaceOperation::kDiscard,
        WorkspaceOperation::kRestore})
    if (what == wva_server::name_of(operation)) return operation;
  return WorkspaceOperation::kRemove;
}

WorkspaceCommand command_of(const ChangeRequest& request) {
  WorkspaceCommand command;
  if (request.what == "add") {
    command.operation = WorkspaceOperation::kAdd;
    command.description = text_of(request.file);
    return command;
  }
  command.operation = operation_of(request.what);
  if (request.object.empty() == (request.id == 0))
    throw ConfigError("command " + request.what + ": exactly one of --object and --id must be given");
  command.object = request.object;
  command.id = static_cast<std::uint16_t>(request.id);
  command.description = request.name;
  command.arm = request.arm;
  command.frame = request.frame;
  if (request.guard_vox >= 0) command.guard_vox = static_cast<std::uint16_t>(request.guard_vox);
  if (request.pose.empty()) return command;
  const auto pose = runtime::parse_pose(request.pose);
  if (!pose) throw ConfigError("command " + request.what + ": --pose: " + pose.status().message());
  command.sets_pose = true;
  (command.operation == WorkspaceOperation::kAttach ? command.X_FO : command.X_WO) = *pose;
  return command;
}

int missing(std::ostream& print, const core::NetworkOptions& network, double timeout_s) {
  print << fmt::format(
      "no answer from wva_server in domain {} for {} s; is it running, and is this its deployment?\n",
      network.domain, timeout_s);
  return runtime::kExitMissing;
}

int list(const Listing& listing, std::ostream& print) {
  print << fmt::format("cell {}, version {}: {} objects in {} bricks\n", listing.cell, listing.version,
                       listing.objects.size(), listing.bricks);
  for (const messages::WorkspaceObject& object : listing.objects) {
    std::string where = fmt::format("\"{}\"", runtime::pose_text(object.X_WO));
    for (const messages::CarriedObject& carried : listing.carried) {
      if (carried.id != object.id) continue;
      where = fmt::format("carried by arm '{}' at its link '{}', there at \"{}\"", carried.arm, carried.frame,
                          runtime::pose_text(carried.X_FO));
    }
    print << fmt::format("{:5}  {:<24}  {}\n", object.id, object.name, where);
  }
  return runtime::kExitDone;
}

void add_object_options(runtime::Command command, ChangeRequest& request) {
  command.option("--object", request.object, "the object's name");
  command.option("--id", request.id, "its id, instead of the name").between(1, 65534);
}

}  // namespace

void add_options(runtime::Command command, ChangeRequest& request) {
  command
      .option("--timeout-s", request.timeout_s,
              "how long to wait for the result, in all; wva_server may need longer and continues then")
      .between(0.1, 3600.0);
  const auto sub = [&](const char* name, const char* summary) {
    runtime::Command app = command.subcommand(name, summary);
    app.on_use([&request, name] { request.what = name; });
    return app;
  };
  sub("add", "add an object to the workspace")
      .option("--file", request.file,
              "YAML of the object, as an entry of a cell file's objects; -: standard input")
      .required();
  runtime::Command move = sub("move", "move an object of the workspace");
  add_object_options(move, request);
  move.option("--pose", request.pose,
              "\"x y z roll pitch yaw\": where it stands now in W, metres and degrees")
      .required();
  move.option("--guard-vox", request.guard_vox, "its guard skin from now on, in voxels; default: as before")
      .between(0, 100);
  add_object_options(sub("remove", "remove an object from the workspace"), request);
  runtime::Command attach = sub("attach", "let an arm carry an object: it becomes a part of the arm");
  add_object_options(attach, request);
  attach.option("--arm", request.arm, "the arm that takes it; default: the one that wva_server follows");
  attach.option("--frame", request.frame, "the arm's link that holds it; default: its last one");
  attach.option(
      "--pose", request.pose,
      "\"x y z roll pitch yaw\": its pose in that link's frame, metres and degrees; default: so that it "
      "stays where it is now");
  runtime::Command release =
      sub("release", "put an object down that an arm carries: it stands in the workspace again");
  add_object_options(release, request);
  release.option("--arm", request.arm, "refused unless this arm carries it; default: whichever does");
  release.option(
      "--pose", request.pose,
      "\"x y z roll pitch yaw\": where it stands now in W, metres and degrees; default: where the arm "
      "holds it now");
  release
      .option("--guard-vox", request.guard_vox, "its guard skin from now on, in voxels; default: as before")
      .between(0, 100);
  runtime::Command name = sub("name", "name a thing that depth cameras see, as long as they follow it");
  add_object_options(name, request);
  name.option("--name", request.name, "what it is called from now on").required();
  add_object_options(sub("freeze", "keep a thing that cameras see as it is, whatever they see there"),
                     request);
  add_object_options(sub("discard", "feel nothing of a thing that cameras see, while they see it there"),
                     request);
  add_object_options(sub("restore", "let cameras decide again about what was frozen or discarded"), request);
  sub("list", "list the objects and their poses");
  command.require_subcommand(1, 1);
}

int run_change(const ChangeRequest& request, const core::NetworkOptions& network, std::ostream& print) {
  const runtime::EndsAtOnce impatient(runtime::kExitFailed);  // who waits for long may give up
  if (request.what == "list") {
    const auto listing = list_objects(network, request.timeout_s);
    return listing ? list(*listing, print) : missing(print, network, request.timeout_s);
  }
  bool was_accepted = false;
  const auto reply = messages::ask(network, "wva_server_command", command_of(request), request.timeout_s,
                                   [&](const messages::WorkspaceReply& accepted) {
                                     print << "accepted: " << accepted.message << std::endl;
                                     was_accepted = true;
                                   });
  if (!reply && was_accepted) {
    print << fmt::format(
        "no result within {} s; wva_server continues (its component_status shows the progress); a command to "
        "remove the object ends what adds it\n",
        request.timeout_s);
    return runtime::kExitFailed;
  }
  if (!reply) return missing(print, network, request.timeout_s);
  if (reply->outcome == messages::WorkspaceOutcome::kRefused) {
    print << "refused: " << reply->message << '\n';
    return runtime::kExitFailed;
  }
  print << fmt::format("done: {}\nversion {}: {} bricks changed, {} removed, in {:.0f} ms\n", reply->message,
                       reply->version, reply->changed_bricks, reply->removed_bricks, 1e3 * reply->seconds);
  return runtime::kExitDone;
}

}  // namespace phantom::wva_server
