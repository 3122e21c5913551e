#include "components/dds_recorder/files.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"

namespace phantom::dds_recorder {

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

}  // namespace phantom::dds_recorder
