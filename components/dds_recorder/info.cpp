#include "components/dds_recorder/info.hpp"

#include <charconv>
#include <ctime>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "common/recording/mcap_check.hpp"
#include "common/runtime/process.hpp"
#include "components/dds_recorder/recording_file.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr std::size_t kMostEvents = 8;  // shown in the table

std::string utc_text(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
  char fraction[8];
  std::snprintf(fraction, sizeof fraction, ".%03d", static_cast<int>(ns / 1'000'000 % 1000));
  return text + std::string(fraction) + " UTC";
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
    if (what == "missing") topic.missing = count;
    if (what == "superseded") topic.superseded = count;
    if (what == "queue_overflow") topic.queue_overflow = count;
    if (what == "dds_lost") topic.dds_lost = count;
    if (what == "dds_rejected") topic.dds_rejected = count;
    if (what == "unwritten") topic.unwritten = count;
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
                    {"rate_hz", topic.rate_hz},
                    {"missing", topic.missing},
                    {"superseded", topic.superseded},
                    {"queue_overflow", topic.queue_overflow},
                    {"dds_lost", topic.dds_lost},
                    {"dds_rejected", topic.dds_rejected},
                    {"unwritten", topic.unwritten}};
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
  out << figures.path << '\n';
  out << "  " << figures.samples << " samples, " << std::fixed << std::setprecision(3) << figures.seconds()
      << " s, " << std::setprecision(1) << 1e-6 * static_cast<double>(figures.bytes) << " MB, "
      << figures.chunks << " chunks\n";
  if (figures.samples > 0)
    out << "  from " << utc_text(figures.start_ns) << " to " << utc_text(figures.end_ns) << '\n';
  if (!figures.about.empty()) {
    out << "  recorded on " << value_of(figures.about, "host") << ", domain "
        << value_of(figures.about, "domain") << ", mode " << value_of(figures.about, "mode") << ", file "
        << value_of(figures.about, "number") << " of its series"
        << (figures.ended.empty() ? "" : "; ended: " + figures.ended) << '\n';
  }
  for (std::size_t i = 0; i < std::min(figures.triggers.size(), kMostEvents); ++i)
    out << "  event: " << value_of(figures.triggers[i], "reason") << '\n';
  if (figures.triggers.size() > kMostEvents)
    out << "  … and " << figures.triggers.size() - kMostEvents << " more events (--json tells all)\n";
  if (!figures.complete)
    out << "  not finished (still being written, or its recorder was killed): read as far as it is whole\n";
  for (const std::string& problem : figures.problems) out << "  problem: " << problem << '\n';
  std::size_t width = 5;
  for (const auto& [name, topic] : figures.topics) width = std::max(width, name.size());
  out << "\n  " << std::left << std::setw(static_cast<int>(width)) << "topic" << std::right << std::setw(10)
      << "samples" << std::setw(10) << "rate Hz" << std::setw(8) << "earlier" << std::setw(9) << "missing"
      << std::setw(9) << "writers"
      << "  type\n";
  for (const auto& [name, topic] : figures.topics) {
    out << "  " << std::left << std::setw(static_cast<int>(width)) << name << std::right << std::setw(10)
        << topic.samples << std::setw(10) << std::setprecision(1) << topic.rate_hz << std::setw(8)
        << topic.carried_over << std::setw(9) << topic.missing + topic.unwritten << std::setw(9)
        << topic.writers << "  " << topic.type << '\n';
    if (topic.queue_overflow + topic.dds_rejected + topic.unwritten > 0)
      out << "    lost in the recorder: " << topic.queue_overflow << " for want of room in its queue, "
          << topic.dds_rejected << " in DDS, " << topic.unwritten << " not written\n";
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
