#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "components/dds_recorder/adapter/dds_adapter.hpp"
#include "components/dds_recorder/adapter/dds_adapter_export.hpp"
#include "components/dds_recorder/adapter/dds_adapter_output.hpp"
#include "components/dds_recorder/config.hpp"
#include "components/dds_recorder/convert.hpp"
#include "components/dds_recorder/info.hpp"
#include "components/dds_recorder/session.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr const char* kTopicsHelp =
    "topics, as shell patterns ('*_state'); one that begins with ! takes away; default: all";

void add_range(runtime::Command app, TimeRange& range) {
  app.option("--from", range.from_s, "seconds from the first sample").between(0.0, 1e9);
  app.option("--until", range.until_s, "likewise; default: to the end").between(0.0, 1e9);
}

/// The command line's subcommands.
struct CommandLine {
  runtime::Command record, trigger, replay, info, check, convert, exporting;
  RecordRequest recording;
  std::string issuer = "dds_recorder trigger";
  ReplayRequest replaying;
  bool original_stamps = false, json = false, endless = false, ros2 = false;
  std::vector<std::filesystem::path> files;
  ConvertRequest converting;
  ExportRequest to_export;

  void add_record(runtime::Command app) {
    record = app.subcommand("record", "record until Ctrl-C");
    record.option("--topics", recording.topics, kTopicsHelp);
    record.option("--folder", recording.folder, "where the files go, instead of the configuration's");
    record.option("--name", recording.name, "how their names begin, instead of the configuration's");
    record.flag("--on-event", recording.on_event,
                "keep the last seconds in memory, write them when something happens");
    record.option("--seconds", recording.seconds, "end after so long; 0: until Ctrl-C").between(0.0, 1e7);
    trigger =
        app.subcommand("trigger", "request all recorders of the domain to write what they hold in memory");
    trigger.option("--by", issuer, "who asks, for their logs");
  }
  void add_replay(runtime::Command app) {
    replay = app.subcommand("replay", "publish what was recorded, each sample at its time");
    replay.option("files", replaying.files, "files, or folders of them").required();
    replay.option("--topics", replaying.topics, kTopicsHelp);
    replay.option("--remap", replaying.remap,
                  "OLD:=NEW: publish a topic under another name; may be given again");
    add_range(replay, replaying.range);
    replay.option("--rate", replaying.rate, "2: twice as fast; 0: as fast as it goes").between(0.0, 1000.0);
    replay.option("--loops", replaying.loops, "how many turns").between(1, 1'000'000'000);
    replay.flag("--loop", endless, "turn until Ctrl-C");
    replay.flag("--original-stamps", original_stamps,
                "leave stamps as they were recorded: readers that are live may refuse them as old");
    replay.flag("--commands", replaying.commands, "also topics that command something (…_command)");
    replay.flag("--beside-live", replaying.beside_live, "also on topics that have a writer now");
    replay.option("--wait", replaying.wait_s, "seconds to wait at most until every topic has a reader")
        .between(0.0, 3600.0);
  }
  void add_offline(runtime::Command app) {
    info = app.subcommand("info", "what is in a recording: topics, samples, rates, losses");
    check = app.subcommand("check", "read every byte: checksums, indexes, counts");
    for (runtime::Command sub : {info, check}) {
      sub.option("files", files, "files, or folders of them").required();
      sub.flag("--json", json, "as JSON");
    }
    convert = app.subcommand(
        "convert", "one file of several, of a part, of some topics, or of what can be read of a damaged one");
    convert.option("files", converting.files, "files, or folders of them").required();
    convert.option("--out", converting.out, "FILE.mcap, or FILE.jsonl: a line of JSON for each sample")
        .required();
    convert.option("--topics", converting.topics, kTopicsHelp);
    add_range(convert, converting.range);
    convert.option("--compression-level", converting.zstd_level, "zstd 1…19; 0: none").between(0, 19);
  }

  void add_export(runtime::Command app) {
    exporting = app.subcommand("export", "a bag of ROS 2: what ros2_gateway says of the arm");
    exporting.option("files", to_export.files, "files, or folders of them").required();
    exporting.flag("--ros2", ros2, "in ROS 2's messages; there is no other form");
    exporting.option("--out", to_export.out, "FILE.mcap").required();
    exporting.option("--arm", to_export.arm, "of the topology's cell; default: the only one");
    exporting.option("--prefix", to_export.names.prefix, "of the topics");
    exporting.option("--frame-prefix", to_export.names.frame_prefix, "of the links' frames");
    exporting.option("--world", to_export.names.world, "frame of the workspace");
    exporting.option("--rate", to_export.rate_Hz, "of each topic of states at most; 0: every sample")
        .between(0.0, 1e6);
    add_range(exporting, to_export.range);
    exporting.option("--compression-level", to_export.zstd_level, "zstd 1…19; 0: none").between(0, 19);
  }

  void add_to(runtime::Command app) {
    app.require_subcommand(0, 1);
    add_record(app);
    add_replay(app);
    add_offline(app);
    add_export(app);
  }
  /// Carries out the subcommand. Returns the exit code; throws as process_main expects.
  int run(const runtime::ProcessOptions& options);
};

// The arm is the deployment's: a recording has no kinematics.
int export_arm_of(const ExportRequest& request, bool ros2, const runtime::ProcessOptions& options) {
  if (!ros2) throw core::ConfigError("export: no format given; allowed: --ros2");
  const auto cell = runtime::load_checked_cell(runtime::load_deployment(options));
  const auto& config = cell.arm(request.arm);
  std::ostringstream urdf;
  if (!config.urdf.empty()) urdf << std::ifstream(config.urdf).rdbuf();
  return run_export(request, runtime::load_arm(config), urdf.str(), std::cout);
}

int CommandLine::run(const runtime::ProcessOptions& options) {
  std::optional<runtime::EndsAtOnce> batch;
  if (info.given() || check.given() || convert.given() || exporting.given())
    batch.emplace(runtime::kExitFailed);
  if (info.given()) return run_info(files, json, std::cout);
  if (check.given()) return run_check(files, json, std::cout);
  if (convert.given()) return run_convert(converting, std::cout);
  if (exporting.given()) return export_arm_of(to_export, ros2, options);
  const Config config = merged(load_config(options.config), recording);
  const auto deployment = runtime::load_deployment(options);
  dds::check_qos_profiles(deployment.network.qos_profiles);
  if (options.check) {
    check_folder(config);
    warn_of_unknown_topics(config);
    std::cout << "configuration is valid: " << (config.recorder.on_event ? "on event" : "continuous")
              << ", into " << std::filesystem::absolute(config.recorder.folder).string() << ", where "
              << free_bytes(config.recorder.folder) / 1'000'000 << " MB are free\n";
    return runtime::kExitDone;
  }
  if (record.given()) return run_record(recording, deployment, config);
  if (replay.given()) {
    replaying.fresh_stamps = !original_stamps;
    if (endless) replaying.loops = 0;
    return run_replay(replaying, deployment.network);
  }
  if (trigger.given()) {
    if (send_mark(deployment.network, issuer, 5.0) > 0) return runtime::kExitDone;
    throw core::MissingError("nobody in domain " + std::to_string(deployment.network.domain) +
                             " hears operator_command");
  }
  throw core::ConfigError(
      "what to do is not said; allowed: record, trigger, replay, info, check, convert, export (--help explains)");
}

}  // namespace
}  // namespace phantom::dds_recorder

int main(int argc, char** argv) {
  using namespace phantom;
  dds_recorder::CommandLine command_line;
  runtime::ProcessDescription description;
  description.name = "dds_recorder";
  description.summary =
      "Records topics into MCAP files, which other tools read as well, and plays them back. "
      "Never holds up what it records: what it cannot keep up with is counted and logged.";
  description.details =
      "Examples:\n"
      "  dds_recorder record                            everything, into ./recordings, until Ctrl-C\n"
      "  dds_recorder record --topics '*_state' percept only these\n"
      "  dds_recorder record --on-event                 only around hit alerts, faults, "
      "`dds_recorder trigger`, SIGUSR1\n"
      "  dds_recorder info recordings                   what is in there\n"
      "  dds_recorder replay recordings --domain 7 --rate 0.5 --loop\n"
      "  dds_recorder convert recordings --from 10 --until 20 --out part.mcap\n"
      "  dds_recorder export --ros2 recordings --out bag.mcap --deployment TOPOLOGY\n"
      "`dds_recorder record --help` and so on explain the options of each.";
  description.add_options = [&](runtime::Command app) { command_line.add_to(app); };
  description.parameters = {dds_recorder::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) { return command_line.run(options); };
  return runtime::process_main(argc, argv, description);
}
