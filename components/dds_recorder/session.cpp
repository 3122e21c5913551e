#include "components/dds_recorder/session.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "common/core/host/host_interfaces.hpp"
#include "common/core/progress.hpp"
#include "common/diagnostics/name_filter.hpp"
#include "components/dds_recorder/adapter/dds_adapter.hpp"
#include "components/dds_recorder/adapter/known_topics.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr double kPoll_s = 0.02;
constexpr core::Nanoseconds kStatusPeriod_ns = core::kNsPerSecond / 2,
                            kLogPeriod_ns = 10 * core::kNsPerSecond;
constexpr double kHangsAfter_s = 5.0;  // one turn may wait for a slow disk
constexpr int kNiceness = 10;          // leaves the CPU to processes that control an arm
constexpr const char* kEventTopics[] = {"hit_alert", "component_status", "operator_command",
                                        "recording_request"};

recording::Attachment attachment_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  recording::Attachment attachment;
  attachment.log_time_ns = static_cast<std::uint64_t>(core::utc_ns());
  attachment.name = file.filename().string();
  attachment.media_type = "application/yaml";
  attachment.data.assign(text.begin(), text.end());
  return attachment;
}

RecordingContext context_of(const runtime::Deployment& deployment, const Config& config) {
  RecordingContext context;
  context.about = {
      {"host", core::host_name()},
      {"domain", std::to_string(deployment.network.domain)},
      {"topology", deployment.name},
      {"topics", config.topics.empty() ? "*" : fmt::format("{}", fmt::join(config.topics, " "))}};
  context.attachments = {attachment_of(deployment.file)};
  if (!deployment.cell.empty()) context.attachments.push_back(attachment_of(deployment.cell));
  return context;
}

std::string in_words(const RecorderFigures& figures) {
  const TopicLosses& losses = figures.losses;
  std::string text = fmt::format("{} samples, {} MB in {} file{}", figures.samples, figures.bytes / 1'000'000,
                                 figures.files, figures.files == 1 ? "" : "s");
  if (losses.any()) text += fmt::format(", {} samples missing", losses.missing);
  if (losses.overflow > 0)
    text += fmt::format(" ({} of them for want of room in the queue)", losses.overflow);
  if (losses.unwritten > 0) text += fmt::format(", {} not written", losses.unwritten);
  return text;
}

core::Health health_of(const RecorderFigures& figures, const Recorder& recorder, bool on_event,
                       std::uint64_t topics_left_out) {
  core::Health health;
  switch (figures.state) {
    case RecorderState::kRecording:
      health.state = core::ComponentState::kRunning;
      health.message = figures.losses.any() ? "recording, with losses" : "recording";
      break;
    case RecorderState::kWaiting:
      health.state = on_event ? core::ComponentState::kRunning : core::ComponentState::kReady;
      health.message = on_event ? "waiting for an event" : "waiting";
      break;
    case RecorderState::kOutOfSpace:
      health.state =
          recorder.ended().empty() ? core::ComponentState::kDegraded : core::ComponentState::kFault;
      health.message = recorder.ended().empty() ? "no space: events are not recorded" : recorder.ended();
      break;
  }
  health.figures = {{"samples", static_cast<double>(figures.samples), ""},
                    {"written", static_cast<double>(figures.bytes) * 1e-6, "MB"},
                    {"files", static_cast<double>(figures.files), ""},
                    {"events", static_cast<double>(figures.events), ""},
                    {"missing", static_cast<double>(figures.losses.missing), ""},
                    {"queue_overflow", static_cast<double>(figures.losses.overflow), ""},
                    {"dds_lost", static_cast<double>(figures.losses.dds_lost), ""},
                    {"unwritten", static_cast<double>(figures.losses.unwritten), ""},
                    {"window", static_cast<double>(figures.window_bytes) * 1e-6, "MB"},
                    {"durable_samples", static_cast<double>(figures.durable_samples), ""},
                    {"durable_forgotten", static_cast<double>(figures.durable_forgotten), ""},
                    {"topics_left_out", static_cast<double>(topics_left_out), ""}};
  return health;
}

/// One recording. DDS threads fill the queue; everything else runs on the calling thread.
class RecordSession {
 public:
  RecordSession(const RecordRequest& request, const runtime::Deployment& deployment, const Config& config)
      : request_(request),
        on_event_(config.recorder.on_event),
        filter_(config.topics),
        queue_(config.queue_bytes),
        watch_(config.recorder.triggers),
        adapter_(
            deployment.network, [this](const std::string& name) { return keeps(name); }, queue_),
        recorder_(config.recorder, context_of(deployment, config), ports(config.recorder.folder),
                  {core::monotonic_ns(), core::utc_ns()}) {}

  int run() {
    const core::Nanoseconds start_ns = core::monotonic_ns();
    open_new_topics();
    recorder_.tick(start_ns);
    log_notices();
    progress_.begin();
    while (recorder_.ended().empty() && !runtime::stop_requested()) {
      progress_.tick();
      queue_.wait(kPoll_s);
      turn(core::monotonic_ns());
      if (request_.seconds > 0 && core::monotonic_ns() - start_ns > core::from_seconds(request_.seconds))
        break;
    }
    adapter_.close_all();
    drain();
    count_losses();
    recorder_.finish(core::monotonic_ns());
    log_notices();
    core::Health last = health(recorder_.figures());
    if (recorder_.ended().empty()) last.state = core::ComponentState::kStopped;
    adapter_.publish_status(last);
    spdlog::info("{}", in_words(recorder_.figures()));
    return recorder_.ended().empty() ? runtime::kExitDone : runtime::kExitFailed;
  }

 private:
  bool keeps(const std::string& topic) const {
    if (filter_.keeps(topic)) return true;
    return on_event_ &&
           std::find(std::begin(kEventTopics), std::end(kEventTopics), topic) != std::end(kEventTopics);
  }

  RecorderPorts ports(const std::filesystem::path& folder) {
    RecorderPorts ports;
    ports.create =
        [](const std::filesystem::path& path) -> core::Expected<std::unique_ptr<recording::ByteSink>> {
      auto file = recording::FileSink::create(path);
      if (!file) return file.status();
      return std::unique_ptr<recording::ByteSink>(std::move(file).value());
    };
    ports.free_bytes = [folder] { return free_bytes(folder); };
    ports.describe = [this](const Guid& writer) { return adapter_.describe(writer); };
    ports.instance_of = [this](TopicNumber topic, std::span<const std::uint8_t> bytes,
                               InstanceKey& instance) {
      return instances_.find(recorder_.topics()[topic].type, bytes, instance);
    };
    return ports;
  }

  void open_new_topics() {
    for (TopicInfo& info : adapter_.new_topics()) {
      const TopicNumber number = recorder_.add_topic(info);
      std::string why;
      if (adapter_.open(info, number, why)) {
        spdlog::debug("hearing {} ({})", info.name, info.type);
      } else {
        spdlog::warn("topic {} is not recorded: {}", info.name, why);
      }
    }
  }

  void drain() {
    queue_.drain([this](const SampleView& sample) {
      recorder_.take(sample);
      if (const auto event = watch_.event_in(recorder_.topics()[sample.head.topic], sample.bytes))
        recorder_.trigger(*event, sample.head.received_ns);
    });
  }

  void count_losses() {
    for (TopicNumber i = 0; i < recorder_.topics().size(); ++i) recorder_.count(i, adapter_.losses(i));
  }

  void turn(core::Nanoseconds now_ns) {
    open_new_topics();
    drain();
    const std::uint32_t signals = runtime::emergency_stop_signals();
    if (signals != signals_) recorder_.trigger("SIGUSR1", now_ns);
    signals_ = signals;
    if (now_ns - counted_ns_ >= core::kNsPerSecond / 4) {
      counted_ns_ = now_ns;
      count_losses();
    }
    recorder_.tick(now_ns);
    log_notices();
    if (now_ns - status_ns_ < kStatusPeriod_ns) return;
    status_ns_ = now_ns;
    const RecorderFigures figures = recorder_.figures();
    core::Health now = health(figures);
    now.loops = {progress_.statistics()};
    adapter_.publish_status(now);
    log_losses(figures);
    if (now_ns - logged_ns_ < kLogPeriod_ns) return;
    logged_ns_ = now_ns;
    spdlog::info("{}", in_words(figures));
  }

  core::Health health(const RecorderFigures& figures) {
    const std::uint64_t left_out = adapter_.topics_left_out();
    if (left_out > 0 && !std::exchange(told_left_out_, true))
      spdlog::warn("there are more than {} topics of others; further ones are not recorded",
                   KnownTopics::kMaxForeign);
    return health_of(figures, recorder_, on_event_, left_out);
  }

  void log_notices() {
    for (const std::string& notice : recorder_.take_notices()) spdlog::info("{}", notice);
  }

  /// Warns when the recorder itself has lost samples, at most once per kStatusPeriod_ns.
  void log_losses(const RecorderFigures& figures) {
    if (figures.losses.overflow == overflow_logged_) return;
    spdlog::warn(
        "{} samples found no room in the queue so far; "
        "allowed: a larger queue_MB, fewer topics, a faster disk",
        figures.losses.overflow);
    overflow_logged_ = figures.losses.overflow;
  }

  const RecordRequest& request_;
  bool on_event_;
  diagnostics::NameFilter filter_;
  SampleQueue queue_;
  EventWatch watch_;
  InstanceFinder instances_;
  DdsAdapter adapter_;
  Recorder recorder_;
  core::Progress progress_{"record", 0.0, kHangsAfter_s};
  std::uint32_t signals_ = runtime::emergency_stop_signals();
  std::uint64_t overflow_logged_ = 0;
  bool told_left_out_ = false;
  core::Nanoseconds counted_ns_ = 0, status_ns_ = 0, logged_ns_ = core::monotonic_ns();
};

}  // namespace

Config merged(Config config, const RecordRequest& request) {
  if (!request.topics.empty()) config.topics = request.topics;
  if (!request.folder.empty()) config.recorder.folder = request.folder;
  if (!request.name.empty()) config.recorder.name = request.name;
  if (request.on_event) config.recorder.on_event = true;
  return config;
}

std::uint64_t free_bytes(const std::filesystem::path& folder) {
  struct statvfs about {};
  std::filesystem::path there = std::filesystem::absolute(folder);
  while (statvfs(there.c_str(), &about) != 0) {
    if (there == there.parent_path()) throw core::MissingError(folder.string() + ": " + std::strerror(errno));
    there = there.parent_path();
  }
  return static_cast<std::uint64_t>(about.f_bavail) * about.f_frsize;
}

void check_folder(const Config& config) {
  const auto& folder = config.recorder.folder;
  std::filesystem::path there = std::filesystem::absolute(folder);
  std::error_code ignored;
  while (!std::filesystem::exists(there, ignored) && there != there.parent_path())
    there = there.parent_path();
  const int problem = std::filesystem::is_directory(there, ignored) ? access(there.c_str(), W_OK | X_OK) : -1;
  if (problem != 0)
    throw core::MissingError(folder.string() + ": cannot be written to: " + there.string() +
                             (std::filesystem::is_directory(there, ignored)
                                  ? std::string(": ") + std::strerror(errno)
                                  : " is no folder"));
  if (const std::uint64_t free = free_bytes(folder); free < config.recorder.margin_bytes) {
    throw core::MissingError(folder.string() + ": only " + std::to_string(free / 1'000'000) +
                             " MB are free; allowed: more than disk.margin_MB, which is " +
                             std::to_string(config.recorder.margin_bytes / 1'000'000));
  }
}

void warn_of_unknown_topics(const Config& config) {
  for (const std::string& name : unknown_names(config.topics))
    spdlog::warn("topics: '{}' is no topic of Phantom: it is recorded only if another system publishes it",
                 name);
}

int run_record(const RecordRequest& request, const runtime::Deployment& deployment, const Config& config) {
  check_folder(config);
  warn_of_unknown_topics(config);
  const auto& folder = config.recorder.folder;
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem || access(folder.c_str(), W_OK) != 0)
    throw core::MissingError(
        folder.string() + ": cannot be written to: " + (problem ? problem.message() : std::strerror(errno)));
  setpriority(PRIO_PROCESS, 0, kNiceness);
  RecordSession session(request, deployment, config);
  return session.run();
}

}  // namespace phantom::dds_recorder
