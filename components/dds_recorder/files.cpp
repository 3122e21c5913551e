#include "components/dds_recorder/files.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"
#include "components/dds_recorder/recording_file.hpp"

namespace phantom::dds_recorder {

std::vector<std::filesystem::path> recordings_in(const std::vector<std::filesystem::path>& given) {
  std::vector<std::filesystem::path> files;
  for (const auto& path : given) {
    if (!std::filesystem::is_directory(path)) {
      if (!std::filesystem::exists(path)) throw core::MissingError(path.string() + ": no such file");
      files.push_back(path);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      if (entry.path().extension() == ".mcap") inside.push_back(entry.path());
    }
    if (inside.empty()) throw core::MissingError(path.string() + ": has no .mcap file");
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

std::vector<OpenedRecording> open_recordings(const std::vector<std::filesystem::path>& files) {
  std::vector<OpenedRecording> opened;
  for (const auto& file : files) {
    auto reader = recording::McapReader::open(file);
    if (!reader && reader.status().code() == core::ErrorCode::kNotFound)
      throw core::MissingError(reader.status().message());
    if (!reader) throw core::ConfigError(reader.status().message());
    opened.push_back({file, std::move(reader).value()});
  }
  std::stable_sort(opened.begin(), opened.end(), [](const auto& a, const auto& b) {
    return a.reader.statistics().message_start_time_ns < b.reader.statistics().message_start_time_ns;
  });
  return opened;
}

std::pair<std::uint64_t, std::uint64_t> times_of(const std::vector<OpenedRecording>& recordings) {
  std::uint64_t first_ns = 0, last_ns = 0;
  bool any = false;
  for (const auto& opened : recordings) {
    const auto& statistics = opened.reader.statistics();
    if (statistics.message_count == 0) continue;
    first_ns = any ? std::min(first_ns, statistics.message_start_time_ns) : statistics.message_start_time_ns;
    last_ns = std::max(last_ns, statistics.message_end_time_ns);
    any = true;
  }
  return {first_ns, last_ns};
}

recording::MessageFilter in_range(const TimeRange& range, std::uint64_t first_ns) {
  const auto at = [first_ns](double s) {
    return first_ns + static_cast<std::uint64_t>(std::llround(s * 1e9));
  };
  recording::MessageFilter filter;
  filter.from_ns = range.from_s > 0 ? at(range.from_s) : 0;
  if (range.until_s >= 0) filter.until_ns = at(range.until_s);
  return filter;
}

std::vector<RangePart> parts_of(const recording::MessageFilter& range) {
  if (range.from_ns == 0) return {{range, false}};
  return {{{{}, 0, range.from_ns}, true}, {range, false}};
}

std::uint64_t read_all(const std::vector<OpenedRecording>& recordings, const recording::MessageFilter& range,
                       const diagnostics::NameFilter& wanted, RecordingListener& listener,
                       std::ostream& notes) {
  std::uint64_t samples = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const recording::McapReader& reader = recordings[i].reader;
    for (const std::string& problem : reader.problems())
      notes << recordings[i].path.string() << ": " << problem << '\n';
    listener.begin(reader);
    for (const auto& part : parts_of(range)) {
      recording::MessageFilter chosen = part.filter;
      chosen.channel = [&](const recording::Channel& channel) {
        return wanted.keeps(channel.topic) && (i == 0 || !is_carried_over(channel)) &&
               (!part.durable_only || is_durable(channel));
      };
      recording::MessageCursor cursor(reader, chosen);
      for (recording::Message message; cursor.next(message); ++samples)
        listener.take(reader.channels().at(message.channel_id), message, !part.durable_only);
      for (const std::string& problem : cursor.problems())
        notes << recordings[i].path.string() << ": " << problem << '\n';
    }
  }
  return samples;
}

void write_whole(const std::filesystem::path& out,
                 const std::function<void(const std::filesystem::path&)>& write) {
  if (std::filesystem::exists(out)) throw core::ConfigError("--out " + out.string() + ": exists already");
  std::filesystem::path partial = out;
  partial += ".partial";
  std::filesystem::remove(partial);
  try {
    write(partial);
    std::filesystem::rename(partial, out);
    // Who is told that it is there may delete what it was made of.
    if (!core::sync_folder_of(out))
      throw std::runtime_error(out.string() + ": cannot be brought to the disk");
  } catch (...) {
    std::filesystem::remove(partial);
    throw;
  }
}

bool is_durable(const recording::Channel& channel) {
  const std::string durability = metadata_of(channel, "qos.durability");
  return !durability.empty() && durability != "volatile";
}

bool is_carried_over(const recording::Channel& channel) {
  return metadata_of(channel, kCarriedOver) == "yes";
}

std::string metadata_of(const recording::Channel& channel, const std::string& key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

}  // namespace phantom::dds_recorder
