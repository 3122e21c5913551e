#include "components/dds_recorder/command_line.hpp"

#include <iostream>
#include <optional>

#include "common/dds/participant.hpp"
#include "components/dds_recorder/convert.hpp"
#include "components/dds_recorder/dds_adapter.hpp"
#include "components/dds_recorder/dds_adapter_output.hpp"
#include "components/dds_recorder/info.hpp"
#include "components/dds_recorder/session.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr const char* kTopicsHelp =
    "topics, as shell patterns ('*_state'); one that begins with ! takes away; default: all";

runtime::Command add(runtime::Command app, const char* name, const char* what) {
  runtime::Command sub = app.subcommand(name, what);
  return sub;
}

void add_range(runtime::Command app, TimeRange& range) {
  app.option("--from", range.from_s, "seconds from the first sample").between(0.0, 1e9);
  app.option("--until", range.until_s, "likewise; default: to the end").between(0.0, 1e9);
}

}  // namespace

struct CommandLine::Impl {
  runtime::Command record, trigger, replay, info, check, convert;
  RecordRequest recording;
  std::string issuer = "dds_recorder trigger";
  ReplayRequest replaying;
  bool original_stamps = false, json = false, endless = false;
  std::vector<std::filesystem::path> files;
  ConvertRequest converting;

  void add_record(runtime::Command app) {
    record = add(app, "record", "record until Ctrl-C");
    record.option("--topics", recording.topics, kTopicsHelp);
    record.option("--folder", recording.folder, "where the files go, instead of the configuration's");
    record.option("--name", recording.name, "how their names begin, instead of the configuration's");
    record.flag("--on-event", recording.on_event,
                "keep the last seconds in memory, write them when something happens");
    record.option("--seconds", recording.seconds, "end after so long; 0: until Ctrl-C").between(0.0, 1e7);
    trigger = add(app, "trigger", "tell all recorders of the domain to write what they hold in memory");
    trigger.option("--by", issuer, "who asks, for their logs");
  }
  void add_replay(runtime::Command app) {
    replay = add(app, "replay", "publish what was recorded, each sample at its time");
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
    replay.flag("--beside-live", replaying.beside_live, "also on topics that somebody writes now");
    replay.option("--wait", replaying.wait_s, "seconds to wait at most until every topic has a reader")
        .between(0.0, 3600.0);
  }
  void add_offline(runtime::Command app) {
    info = add(app, "info", "what is in a recording: topics, samples, rates, losses");
    check = add(app, "check", "read every byte: checksums, indexes, counts");
    for (runtime::Command sub : {info, check}) {
      sub.option("files", files, "files, or folders of them").required();
      sub.flag("--json", json, "as JSON");
    }
    convert = add(app, "convert",
                  "one file of several, of a part, of some topics, or of what can be read of a damaged one");
    convert.option("files", converting.files, "files, or folders of them").required();
    convert.option("--out", converting.out, "FILE.mcap, or FILE.jsonl: a line of JSON for each sample")
        .required();
    convert.option("--topics", converting.topics, kTopicsHelp);
    add_range(convert, converting.range);
    convert.option("--compression-level", converting.zstd_level, "zstd 1…19; 0: none").between(0, 19);
  }
};

CommandLine::CommandLine() : impl_(std::make_unique<Impl>()) {}
CommandLine::~CommandLine() = default;

void CommandLine::add_to(runtime::Command app) {
  app.require_subcommand(0, 1);
  impl_->add_record(app);
  impl_->add_replay(app);
  impl_->add_offline(app);
}

int CommandLine::run(const runtime::ProcessOptions& options) {
  Impl& asked = *impl_;
  std::optional<runtime::EndsAtOnce> batch;
  if (asked.info.given() || asked.check.given() || asked.convert.given()) batch.emplace(runtime::kExitFailed);
  if (asked.info.given()) return run_info(asked.files, asked.json, std::cout);
  if (asked.check.given()) return run_check(asked.files, asked.json, std::cout);
  if (asked.convert.given()) return run_convert(asked.converting, std::cout);
  const Config config = merged(load_config(options.config), asked.recording);
  const auto deployment = runtime::load_deployment(options);
  dds::check_qos_profiles(deployment.network.qos_profiles);
  if (options.check) {
    std::cout << "configuration is valid: " << (config.recorder.on_event ? "on event" : "continuous")
              << ", into " << std::filesystem::absolute(config.recorder.folder).string() << ", where "
              << free_bytes(config.recorder.folder) / 1'000'000 << " MB are free\n";
    return runtime::kExitDone;
  }
  if (asked.record.given()) return run_record(asked.recording, deployment, config);
  if (asked.replay.given()) {
    asked.replaying.fresh_stamps = !asked.original_stamps;
    if (asked.endless) asked.replaying.loops = 0;
    return run_replay(asked.replaying, deployment.network);
  }
  if (asked.trigger.given()) {
    if (send_mark(deployment.network, asked.issuer, 5.0) > 0) return runtime::kExitDone;
    throw core::MissingError("nobody in domain " + std::to_string(deployment.network.domain) +
                             " hears operator_command");
  }
  throw core::ConfigError(
      "what to do is not said; allowed: record, trigger, replay, info, check, convert (--help explains)");
}

}  // namespace phantom::dds_recorder
