#include "components/dds_recorder/info.hpp"

#include <spdlog/fmt/chrono.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "common/core/clock.hpp"
#include "common/recording/mcap_check.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_recorder/recording_file.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr std::size_t kMaxEvents = 8;  // shown in the table

std::string utc_text(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / core::kNsPerSecond);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", fmt::gmtime(seconds), ns / 1'000'000 % 1000);
}

/// Adds the counts of a losses record, "TOPIC.what" → n, to their topics.
void add_losses(const recording::StringMap& losses, std::map<std::string, TopicFigures>& topics) {
  for (const auto& [key, value] : losses) {
    const auto dot = key.rfind('.');
    if (dot == std::string::npos) continue;
    std::uint64_t count = 0;
    std::from_chars(value.data(), value.data() + value.size(), count);
    TopicFigures& topic = topics[key.substr(0, dot)];
    const std::string what = key.substr(dot + 1);
    for (const auto& [reason, member] : kLossReasons) {
      if (what == reason) topic.losses.*member = count;
    }
  }
}

std::string value_of(const recording::StringMap& map, const std::string& key) {
  const auto found = map.find(key);
  return found == map.end() ? "" : found->second;
}

}  // namespace

FileFigures figures_of(const OpenedRecording& opened) {
  const recording::McapReader& reader = opened.reader;
  const recording::Statistics& statistics = reader.statistics();
  FileFigures figures;
  figures.path = opened.path.string();
  figures.bytes = reader.source().size();
  figures.complete = reader.complete();
  figures.problems = reader.problems();
  figures.start_ns = statistics.message_start_time_ns;
  figures.end_ns = statistics.message_end_time_ns;
  figures.samples = statistics.message_count;
  figures.chunks = statistics.chunk_count;
  if (auto about = reader.metadata(kAboutRecord); !about.empty()) figures.about = std::move(about.front());
  figures.triggers = reader.metadata(kTriggerRecord);
  if (const auto end = reader.metadata(kEndRecord); !end.empty())
    figures.ended = value_of(end.back(), "reason");
  for (const auto& attachment : reader.attachment_indexes()) figures.attachments.push_back(attachment.name);
  std::map<std::string, std::set<std::string>> writers;
  for (const auto& [id, channel] : reader.channels()) {
    TopicFigures& topic = figures.topics[channel.topic];
    const auto schema = reader.schemas().find(channel.schema_id);
    topic.type = schema == reader.schemas().end() ? metadata_of(channel, "type") : schema->second.name;
    const auto count = statistics.channel_message_counts.find(id);
    const std::uint64_t samples = count == statistics.channel_message_counts.end() ? 0 : count->second;
    (is_carried_over(channel) ? topic.carried_over : topic.samples) += samples;
    writers[channel.topic].insert(metadata_of(channel, "writer"));
  }
  if (const auto losses = reader.metadata(kLossesRecord); !losses.empty())
    add_losses(losses.back(), figures.topics);
  for (auto& [name, topic] : figures.topics) {
    topic.writers = writers[name].size();
    if (figures.end_ns > figures.start_ns)
      topic.rate_hz = static_cast<double>(topic.samples) / figures.seconds();
  }
  return figures;
}

nlohmann::ordered_json json_of(const FileFigures& figures) {
  nlohmann::ordered_json topics = nlohmann::ordered_json::object();
  for (const auto& [name, topic] : figures.topics) {
    topics[name] = {{"type", topic.type},
                    {"samples", topic.samples},
                    {"carried_over", topic.carried_over},
                    {"writers", topic.writers},
                    {"rate_hz", topic.rate_hz}};
    for (const auto& [reason, count] : kLossReasons) topics[name][reason] = topic.losses.*count;
  }
  return {{"file", figures.path},
          {"bytes", figures.bytes},
          {"complete", figures.complete},
          {"problems", figures.problems},
          {"start_ns", figures.start_ns},
          {"end_ns", figures.end_ns},
          {"seconds", figures.seconds()},
          {"samples", figures.samples},
          {"chunks", figures.chunks},
          {"ended", figures.ended},
          {"about", figures.about},
          {"triggers", figures.triggers},
          {"attachments", figures.attachments},
          {"topics", topics}};
}

void print(const FileFigures& figures, std::ostream& out) {
  out << fmt::format("{}\n  {} samples, {:.3f} s, {:.1f} MB, {} chunks\n", figures.path, figures.samples,
                     figures.seconds(), 1e-6 * static_cast<double>(figures.bytes), figures.chunks);
  if (figures.samples > 0)
    out << "  from " << utc_text(figures.start_ns) << " to " << utc_text(figures.end_ns) << '\n';
  if (const auto& about = figures.about; !about.empty()) {
    out << fmt::format("  recorded on {}, domain {}, mode {}, file {} of its series{}\n",
                       value_of(about, "host"), value_of(about, "domain"), value_of(about, "mode"),
                       value_of(about, "number"), figures.ended.empty() ? "" : "; ended: " + figures.ended);
  }
  for (std::size_t i = 0; i < std::min(figures.triggers.size(), kMaxEvents); ++i)
    out << "  event: " << value_of(figures.triggers[i], "reason") << '\n';
  if (figures.triggers.size() > kMaxEvents)
    out << "  … and " << figures.triggers.size() - kMaxEvents << " more events (--json lists all)\n";
  if (!figures.complete)
    out << "  not finished (still being written, or its recorder was killed): read as far as it is whole\n";
  for (const std::string& problem : figures.problems) out << "  problem: " << problem << '\n';
  std::size_t width = 5;
  for (const auto& [name, topic] : figures.topics) width = std::max(width, name.size());
  constexpr const char* kRow = "  {:<{}}{:>10}{:>10}{:>8}{:>9}{:>9}  {}\n";
  out << '\n'
      << fmt::format(kRow, "topic", width, "samples", "rate Hz", "earlier", "missing", "writers", "type");
  for (const auto& [name, topic] : figures.topics) {
    const TopicLosses& losses = topic.losses;
    out << fmt::format(kRow, name, width, topic.samples, fmt::format("{:.1f}", topic.rate_hz),
                       topic.carried_over, losses.missing + losses.unwritten, topic.writers, topic.type);
    if (losses.overflow + losses.dds_rejected + losses.unwritten > 0)
      out << fmt::format(
          "    lost in the recorder: {} for want of room in its queue, {} in DDS, {} not written\n",
          losses.overflow, losses.dds_rejected, losses.unwritten);
  }
  out << '\n';
}

int run_info(const std::vector<std::filesystem::path>& files, bool json, std::ostream& out) {
  auto all = nlohmann::ordered_json::array();
  for (const auto& opened : open_recordings(recordings_in(files))) {
    const FileFigures figures = figures_of(opened);
    if (json) {
      all.push_back(json_of(figures));
    } else {
      print(figures, out);
    }
  }
  if (json) out << all.dump(2) << '\n';
  return runtime::kExitDone;
}

int run_check(const std::vector<std::filesystem::path>& files, bool json, std::ostream& out) {
  auto all = nlohmann::ordered_json::array();
  bool ok = true;
  for (const auto& file : recordings_in(files)) {
    const auto report = recording::check(file);
    if (!report) throw core::ConfigError(report.status().message());
    ok = ok && report->ok();
    all.push_back({{"file", file.string()},
                   {"ok", report->ok()},
                   {"samples", report->messages},
                   {"chunks", report->chunks},
                   {"bytes", report->bytes},
                   {"problems", report->problems}});
    if (json) continue;
    out << file.string() << ": " << report->messages << " samples in " << report->chunks << " chunks, "
        << report->bytes << " bytes: " << (report->ok() ? "all well" : "not all well") << '\n';
    for (const std::string& problem : report->problems) out << "  " << problem << '\n';
    if (!report->ok()) out << "  `dds_recorder convert` makes a whole file of what can be read\n";
  }
  if (json) out << all.dump(2) << '\n';
  return ok ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::dds_recorder
