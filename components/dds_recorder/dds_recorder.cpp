#include "components/dds_recorder/dds_recorder.hpp"

#include <spdlog/fmt/chrono.h>

namespace phantom::dds_recorder {
namespace {

constexpr core::Nanoseconds kLookPeriod_ns = core::kNsPerSecond;    // between checks of the disk's free space
constexpr core::Nanoseconds kLossesPeriod_ns = core::kNsPerSecond;  // between records of new losses
constexpr std::uint64_t kLookAfterBytes = 32'000'000;  // checks the disk before kLookPeriod_ns is over

std::string utc_name(std::uint64_t utc_ns) {
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(static_cast<std::time_t>(utc_ns / core::kNsPerSecond)));
}

std::string in_MB(std::uint64_t bytes) { return std::to_string(bytes / 1'000'000) + " MB"; }

}  // namespace

Recorder::Recorder(RecorderSettings settings, RecordingContext context, RecorderPorts ports, ClockPair clocks)
    : settings_(std::move(settings)),
      context_(std::move(context)),
      ports_(std::move(ports)),
      clocks_(clocks),
      durable_(ports_.instance_of, settings_.durable_bytes),
      window_(settings_.before_ns, settings_.window_bytes) {}

Recorder::~Recorder() = default;

TopicNumber Recorder::add_topic(TopicInfo topic) {
  topics_.push_back(std::move(topic));
  losses_.emplace_back();
  return static_cast<TopicNumber>(topics_.size() - 1);
}

void Recorder::count(TopicNumber topic, const TopicLosses& input) {
  losses_[topic].overflow = input.overflow;
  losses_[topic].dds_lost = input.dds_lost;
  losses_[topic].dds_rejected = input.dds_rejected;
}

std::vector<TopicLosses> Recorder::losses_of_file() const {
  std::vector<TopicLosses> since = losses_;
  for (std::size_t i = 0; i < losses_at_start_.size(); ++i) since[i] -= losses_at_start_[i];
  return since;
}

void Recorder::note(std::string notice) {
  if (notices_.size() < kMaxNotices) {
    notices_.push_back(std::move(notice));
  } else {
    ++notices_left_out_;
  }
}

std::vector<std::string> Recorder::take_notices() {
  if (notices_left_out_ > 0)
    notices_.push_back("and " + std::to_string(std::exchange(notices_left_out_, 0)) + " more like these");
  return std::exchange(notices_, {});
}

void Recorder::stop_for(const std::string& reason) {
  out_of_space_ = true;
  note(reason);
  if (!settings_.on_event) ended_ = reason;
}

void Recorder::fail(const core::Status& status, core::Nanoseconds now_ns) {
  const std::string file = file_ ? file_->path().string() : "";
  file_.reset();  // its complete chunks can be read
  looked_ns_ = now_ns;
  stop_for("recording ended: " + status.message() +
           (file.empty() ? "" : "; what was written before can be read"));
}

void Recorder::look_at_disk(core::Nanoseconds now_ns) {
  looked_ns_ = now_ns;
  bytes_at_look_ = file_ ? file_->bytes() : 0;
  const std::uint64_t free = ports_.free_bytes();
  if (out_of_space_) {
    if (!ended_.empty() || free < settings_.margin_bytes + settings_.margin_bytes / 10) return;
    out_of_space_ = false;
    note("space available again: recording continues at the next event");
    return;
  }
  if (free >= settings_.margin_bytes) return;
  if (file_) close("disk margin", now_ns);
  stop_for("recording ended in order: " + in_MB(free) + " are free in " + settings_.folder.string() +
           ", of which " + in_MB(settings_.margin_bytes) + " (disk.margin_MB) are left to others");
}

bool Recorder::write_prefix(core::Nanoseconds now_ns) {
  recording::StringMap about = context_.about;
  about["series"] = series_;
  about["number"] = std::to_string(number_);
  about["mode"] = settings_.on_event ? "on_event" : "continuous";
  about["utc_minus_monotonic_ns"] = std::to_string(clocks_.utc_ns - clocks_.monotonic_ns);
  about["carried_over"] = std::to_string(durable_.size());
  about["carried_over_forgotten"] = std::to_string(durable_.forgotten());
  core::Status status = file_->note(kAboutRecord, std::move(about));
  for (const auto& attachment : context_.attachments) {
    if (status) status = file_->attach(attachment);
  }
  const std::uint64_t log_time_ns = clocks_.utc_of(now_ns);
  std::uint64_t left_out = 0;
  durable_.for_each([&](const Sample& sample) {
    if (!status) return;
    status = file_->write(sample.view(), log_time_ns, true);
    if (status || !file_->status()) return;
    ++left_out;  // of so many writers that there is no channel for it
    status = {};
  });
  if (status && left_out > 0) {
    status = file_->note(kLeftOutRecord, {{"carried_over", std::to_string(left_out)}});
    note(std::to_string(left_out) + " durable samples of too many writers are not at the file's start");
  }
  if (!status) fail(status, now_ns);
  return status.is_ok();
}

/// Opens the next file of the series, or of a new series if there is none. Returns whether a file is open.
bool Recorder::open(core::Nanoseconds now_ns) {
  if (out_of_space_) return false;
  look_at_disk(now_ns);
  if (out_of_space_) return false;
  if (series_.empty()) {
    series_ = settings_.name + "_" + utc_name(clocks_.utc_of(now_ns));
    number_ = 0;
  }
  auto path = settings_.folder / fmt::format("{}_{:03}.mcap", series_, number_);
  auto sink = ports_.create(path);
  for (int other = 2; !sink && sink.status().code() == core::ErrorCode::kFailedPrecondition && other < 1000;
       ++other) {
    path = settings_.folder / fmt::format("{}-{}_{:03}.mcap", series_, other, number_);  // two in one second
    sink = ports_.create(path);
  }
  if (!sink) return fail(sink.status(), now_ns), false;
  recording::WriterOptions options;
  options.chunk_bytes = settings_.chunk_bytes;
  options.zstd_level = settings_.zstd_level;
  file_ = std::make_unique<RecordingFile>(path, std::move(sink).value(), options, topics_, ports_.describe);
  opened_ns_ = flushed_ns_ = synced_ns_ = noted_ns_ = now_ns;
  losses_at_start_ = losses_written_ = losses_;
  triggers_noted_ = 0;
  ++files_;
  if (!write_prefix(now_ns)) return false;
  note("writing " + path.string());
  return true;
}

void Recorder::write_losses(core::Nanoseconds now_ns) {
  noted_ns_ = now_ns;
  if (losses_ == losses_written_) return;
  losses_written_ = losses_;
  auto record = losses_record(topics_, losses_of_file());
  record["log_time_ns"] = std::to_string(clocks_.utc_of(now_ns));
  if (core::Status status = file_->note(kLossesRecord, std::move(record)); !status) fail(status, now_ns);
}

void Recorder::close(const std::string& reason, core::Nanoseconds now_ns) {
  write_losses(now_ns);
  if (!file_) return;
  core::Status status =
      file_->note(kEndRecord, {{"reason", reason}, {"log_time_ns", std::to_string(clocks_.utc_of(now_ns))}});
  if (status) status = file_->finish();
  bytes_ += file_->bytes();
  if (!status) return fail(status, now_ns);
  note(file_->path().string() + ": " + std::to_string(file_->samples()) + " samples, " +
       in_MB(file_->bytes()) + ", ended: " + reason);
  file_.reset();
  ++number_;
}

void Recorder::keep(Sample sample) {
  const TopicInfo& topic = topics_[sample.head.topic];
  if (topic.durable) durable_.put(std::move(sample), topic.keyed);
}

bool Recorder::write(const SampleView& sample) {
  if (!file_) return false;
  const core::Nanoseconds now_ns = sample.head.received_ns;
  core::Status status = file_->write(sample, clocks_.utc_of(now_ns), false);
  if (!status && file_->status()) {  // the number of channels in a file is limited
    close("split", now_ns);
    if (!open(now_ns)) return false;
    status = file_->write(sample, clocks_.utc_of(now_ns), false);
  }
  if (!status && file_) fail(status, now_ns);
  return status.is_ok();
}

/// Writes the sample. Keeps it, too, if the next file has to begin with it.
void Recorder::put(const SampleView& sample) {
  const core::Nanoseconds now_ns = sample.head.received_ns;
  if (write(sample)) {
    ++samples_;
  } else {
    ++losses_[sample.head.topic].unwritten;
  }
  if (topics_[sample.head.topic].durable) keep(owned(sample));
  if (!file_) return;
  if (file_->bytes() >= settings_.split_bytes) {
    close("split", now_ns);
    open(now_ns);
  } else if (file_->bytes() > bytes_at_look_ + kLookAfterBytes) {
    look_at_disk(now_ns);
  }
}

void Recorder::take(const SampleView& sample) {
  TopicLosses& losses = losses_[sample.head.topic];
  (topics_[sample.head.topic].durable ? losses.superseded : losses.missing) += gaps_.gap_before(sample.head);
  if (settings_.on_event && !file_) {
    window_.put(owned(sample), [this](Sample&& old) { keep(std::move(old)); });
  } else {
    put(sample);
  }
}

void Recorder::trigger(const std::string& reason, core::Nanoseconds now_ns) {
  ++events_;
  note("event: " + reason);
  if (settings_.on_event) {
    event_until_ns_ = now_ns + settings_.after_ns;
    if (!file_) {
      series_ = settings_.name + "_event_" + utc_name(clocks_.utc_of(now_ns));
      number_ = 0;
      const core::Nanoseconds start_ns = window_.size() > 0 ? window_.oldest_ns() : now_ns;
      if (open(start_ns)) {
        opened_ns_ = flushed_ns_ = synced_ns_ = noted_ns_ = now_ns;
        window_.drain([this](Sample&& old) { put(old.view()); });
      }
    }
  }
  if (!file_ || triggers_noted_ == kMaxTriggers) return;
  if (++triggers_noted_ == kMaxTriggers) note("further events are counted, not noted in this file");
  const recording::StringMap record{{"reason", reason},
                                    {"log_time_ns", std::to_string(clocks_.utc_of(now_ns))}};
  if (core::Status status = file_->note(kTriggerRecord, record); !status) fail(status, now_ns);
}

void Recorder::tick(core::Nanoseconds now_ns) {
  if (now_ns - looked_ns_ >= kLookPeriod_ns) look_at_disk(now_ns);
  if (!settings_.on_event && !file_ && ended_.empty()) open(now_ns);
  if (!file_) return;
  if (settings_.on_event && now_ns >= event_until_ns_) return close("event over", now_ns);
  if (now_ns - opened_ns_ >= settings_.split_ns) {
    close("split", now_ns);
    if (!open(now_ns)) return;
  }
  if (now_ns - noted_ns_ >= kLossesPeriod_ns) write_losses(now_ns);
  core::Status status;
  if (file_ && now_ns - flushed_ns_ >= settings_.flush_ns) {
    flushed_ns_ = now_ns;
    status = file_->flush();
  }
  if (file_ && status && now_ns - synced_ns_ >= settings_.sync_ns) {
    synced_ns_ = now_ns;
    status = file_->sync();
  }
  if (!status) fail(status, now_ns);
}

void Recorder::finish(core::Nanoseconds now_ns) {
  if (file_) close("stopped", now_ns);
}

RecorderFigures Recorder::figures() const {
  RecorderFigures figures;
  figures.state = out_of_space_ ? RecorderState::kOutOfSpace
                  : file_       ? RecorderState::kRecording
                                : RecorderState::kWaiting;
  figures.samples = samples_;
  figures.bytes = bytes_ + (file_ ? file_->bytes() : 0);
  figures.files = files_;
  figures.events = events_;
  for (const TopicLosses& topic : losses_) figures.losses += topic;
  figures.window_samples = window_.size();
  figures.window_bytes = window_.bytes();
  figures.durable_samples = durable_.size();
  figures.durable_bytes = durable_.bytes();
  figures.durable_forgotten = durable_.forgotten();
  if (file_) figures.file = file_->path().string();
  return figures;
}

}  // namespace phantom::dds_recorder
