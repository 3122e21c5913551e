#include "components/dds_recorder/adapter/dds_adapter_output.hpp"

#include <spdlog/spdlog.h>
#include <time.h>

#include <algorithm>
#include <mutex>

#include "common/core/text.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_writer.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_recorder/adapter/dds_adapter_restamp.hpp"
#include "components/dds_recorder/adapter/dds_adapter_topics.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr core::Nanoseconds kMaxHold_ns = 2 * core::kNsPerSecond;
constexpr double kDiscovery_s = 1.0;  // until then every participant of the same network has announced itself

/// The other processes that write topics now.
class LiveWriters : public observation::DiscoveryListener {
 public:
  void on_participant(const diagnostics::ParticipantInfo& info, diagnostics::Presence presence) override {
    const std::lock_guard lock(mutex_);
    if (presence == diagnostics::Presence::kAppeared || presence == diagnostics::Presence::kChanged) {
      graph_.put(info);
    } else {
      graph_.remove(info.guid);
    }
  }
  void on_endpoint(const diagnostics::EndpointInfo& info, diagnostics::Presence presence) override {
    const std::lock_guard lock(mutex_);
    if (presence != diagnostics::Presence::kAppeared) graph_.remove(info.guid);
    if (presence == diagnostics::Presence::kAppeared && info.writer) graph_.put(info);
  }
  /// Returns the process that writes the topic in one of the partitions: "slave_io (process 12)"; empty if
  /// there is none.
  std::string writer_of(const std::string& topic, const std::vector<std::string>& partitions) const {
    const std::lock_guard lock(mutex_);
    for (const auto& [guid, endpoint] : graph_.endpoints()) {
      if (endpoint.topic == topic && diagnostics::share_a_partition(endpoint.qos.partitions, partitions))
        return graph_.who(guid);
    }
    return {};
  }

 private:
  mutable std::mutex mutex_;
  diagnostics::Graph graph_;
};

class ProcessClock : public ReplayClock {
 public:
  core::Nanoseconds now_ns() override { return core::monotonic_ns(); }
  bool sleep_until(core::Nanoseconds at_ns) override {
    // Long waits end early on a stop request; short ones are exact.
    while (at_ns - core::monotonic_ns() > core::kNsPerSecond / 10) {
      if (!runtime::sleep_unless_stopped(0.05)) return false;
    }
    const timespec at{at_ns / core::kNsPerSecond, at_ns % core::kNsPerSecond};
    if (at_ns > core::monotonic_ns()) clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
    return !runtime::stop_requested();
  }
};

class DdsOutput : public ReplaySink {
 public:
  DdsOutput(const core::NetworkOptions& network, std::map<std::string, TopicInfo> topics, bool fresh_stamps,
            double rate)
      : partitions_(network.partition.empty() ? std::vector<std::string>{}
                                              : std::vector<std::string>{network.partition}),
        observer_("dds_recorder replay", network, live_),
        fresh_stamps_(fresh_stamps),
        restamper_(observer_.participant().session(), rate > 0 ? rate : 1.0) {
    for (auto& [name, info] : topics) {
      Output& output = outputs_[name];
      output.known = dds::topic_of_type(info.type);
      output.info = std::move(info);
    }
  }

  /// Returns a topic that another process writes now and its writer; empty if there is none.
  std::string conflict() const {
    for (const auto& [name, output] : outputs_) {
      if (const std::string writer = live_.writer_of(output.info.name, partitions_); !writer.empty())
        return output.info.name + " is written by " + writer;
    }
    return {};
  }

  /// Creates the writers and waits for their readers. Returns the names of the topics without a reader.
  std::string announce(double wait_s) {
    for (auto& [name, output] : outputs_) make_writer(output);
    const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(wait_s);
    std::string unread;
    do {
      unread.clear();
      for (const auto& [name, output] : outputs_) {
        if (output.writer && output.writer->matched() == 0) core::add_to_list(unread, output.info.name);
      }
    } while (!unread.empty() && core::monotonic_ns() < until_ns && runtime::sleep_unless_stopped(0.02));
    return unread;
  }

  /// Waits until readers have the last samples, because samples that they have not fetched are lost with the
  /// writer.
  void finish() {
    for (auto& [name, output] : outputs_) {
      if (output.writer && output.readers_answer) hold_for_readers(output);
    }
  }

  void begin(core::Nanoseconds now_ns) override { restamper_.begin(now_ns, core::utc_ns()); }

  bool write(const std::string& topic, const recording::Message& message, core::Nanoseconds due_ns) override {
    Output& output = outputs_.at(topic);
    if (!output.writer) return false;
    if (output.readers_answer && output.events_kept > 0 && output.since_hold++ == output.events_kept)
      hold_for_readers(output);
    if (!fresh_stamps_ || output.known == nullptr) return output.writer->write(message.data);
    bytes_.assign(message.data.begin(), message.data.end());
    restamper_.restamp(*output.known, due_ns, bytes_);
    return output.writer->write(bytes_);
  }

 private:
  struct Output {
    TopicInfo info;
    const dds::TopicDescription* known = nullptr;
    std::unique_ptr<dds::CdrCodec> codec;  // finds instances
    std::unique_ptr<observation::PayloadWriter> writer;
    int events_kept = 0;  // events that the writer can repeat; 0: states, of which only the newest counts
    int since_hold = 0;
    bool readers_answer = true;
  };

  /// Waits for readers that are slower than the replay, so that they miss no event: before the writer drops
  /// the first event that a reader may not have. A topic whose readers do not answer is not waited for again.
  static void hold_for_readers(Output& output) {
    output.since_hold = 1;
    if (output.writer->wait_until_received(kMaxHold_ns)) return;
    output.readers_answer = false;
    spdlog::warn("a reader of {} does not take its samples; from now on it is not waited for",
                 output.info.name);
  }

  void make_writer(Output& output) {
    if (output.info.keyed && output.known == nullptr) {
      spdlog::warn("topic {} is left out: the key of its type {} is not known", output.info.name,
                   output.info.type);
      return;
    }
    observation::PayloadWriter::InstanceOf instance_of;
    if (output.info.keyed) {
      output.codec = std::make_unique<dds::CdrCodec>(*output.known);
      instance_of = [codec = output.codec.get()](auto bytes, auto& instance) {
        return codec->instance_of(bytes, instance);
      };
    }
    diagnostics::EndpointQos qos = writer_qos(output.info);
    qos.partitions = partitions_;
    output.writer = std::make_unique<observation::PayloadWriter>(
        observer_.participant(),
        observation::PayloadTopic{output.info.name, output.info.type, output.info.keyed}, qos,
        history_depth(output.info), std::move(instance_of));
    if (qos.reliability == diagnostics::Reliability::kReliable && !output.info.durable)
      output.events_kept = history_depth(output.info);
  }

  LiveWriters live_;
  const std::vector<std::string> partitions_;  // the cell's, into which it is replayed
  observation::Observer observer_;
  bool fresh_stamps_;
  Restamper restamper_;
  std::vector<std::uint8_t> bytes_;
  std::map<std::string, Output> outputs_;
};

}  // namespace

int run_replay(const ReplayRequest& request, const core::NetworkOptions& network) {
  validate(request);
  const auto recordings = open_recordings(recordings_in(request.files));
  auto topics = topics_to_replay(recordings, request);
  if (topics.empty())
    throw core::ConfigError("no topic of the recording is meant; `dds_recorder info` lists them");
  DdsOutput output(network, std::move(topics), request.fresh_stamps, request.rate);
  if (!runtime::sleep_unless_stopped(kDiscovery_s)) return runtime::kExitDone;
  if (const std::string conflict = output.conflict(); !conflict.empty() && !request.beside_live) {
    throw core::MissingError(conflict +
                             " now: a replay beside it would mix past and present; "
                             "use another --domain, --remap, or --beside-live");
  }
  if (const std::string unread = output.announce(request.wait_s); !unread.empty())
    spdlog::info("no reader of {}", unread);
  ProcessClock clock;
  const ReplayFigures figures = replay(recordings, request, output, clock);
  output.finish();
  for (const std::string& problem : figures.problems)
    spdlog::error("{}: its samples were not replayed", problem);
  spdlog::info("{} samples replayed in {} {}, latest {:.1f} ms after its time", figures.samples,
               figures.loops, figures.loops == 1 ? "turn" : "turns",
               1e-6 * static_cast<double>(figures.worst_lateness_ns));
  if (figures.failed > 0) spdlog::error("{} samples could not be sent", figures.failed);
  const bool whole = std::ranges::all_of(
      recordings, [](const OpenedRecording& opened) { return opened.reader.chunks_left_out() == 0; });
  if (!whole) spdlog::error("chunks that cannot be read were not replayed");
  return figures.failed == 0 && figures.problems.empty() && whole ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::dds_recorder
