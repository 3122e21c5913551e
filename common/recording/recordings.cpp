#include "common/recording/recordings.hpp"

#include <algorithm>

#include "common/core/errors.hpp"

namespace phantom::recording {

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

std::vector<OpenedRecording> open_recordings(const std::vector<std::filesystem::path>& files,
                                             ReaderLimits limits) {
  std::vector<OpenedRecording> opened;
  for (const auto& file : files) {
    auto reader = McapReader::open(file, limits);
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

bool is_durable(const Channel& channel) {
  const std::string durability = metadata_of(channel, "qos.durability");
  return !durability.empty() && durability != "volatile";
}

bool is_carried_over(const Channel& channel) { return metadata_of(channel, kCarriedOver) == "yes"; }

std::string metadata_of(const Channel& channel, const std::string& key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

}  // namespace phantom::recording
