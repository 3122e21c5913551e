#include "components/dds_recorder/files.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"
#include "common/core/text.hpp"
#include "common/runtime/process/process.hpp"

namespace phantom::dds_recorder {

recording::MessageFilter in_range(const TimeRange& range, std::uint64_t first_ns) {
  const auto at = [first_ns](double s) {
    return first_ns + static_cast<std::uint64_t>(std::llround(s * 1e9));
  };
  if (range.until_s >= 0 && range.until_s <= range.from_s)
    throw core::ConfigError("--until " + core::formatted("%g", range.until_s) + ": is not after --from " +
                            core::formatted("%g", range.from_s) + "; allowed: a later time");
  recording::MessageFilter filter;
  filter.from_ns = range.from_s > 0 ? at(range.from_s) : 0;
  if (range.until_s >= 0) filter.until_ns = at(range.until_s);
  return filter;
}

std::vector<RangePart> parts_of(const recording::MessageFilter& range) {
  if (range.from_ns == 0) return {{range, false}};
  return {{{{}, 0, range.from_ns}, true}, {range, false}};
}

ReadFigures read_all(const std::vector<OpenedRecording>& recordings, const recording::MessageFilter& range,
                     const diagnostics::NameFilter& wanted, RecordingListener& listener,
                     std::ostream& notes) {
  ReadFigures read;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const recording::McapReader& reader = recordings[i].reader;
    for (const std::string& problem : reader.problems())
      notes << recordings[i].path.string() << ": " << problem << '\n';
    read.unread += reader.chunks_left_out();
    listener.begin(reader);
    for (const auto& part : parts_of(range)) {
      recording::MessageFilter chosen = part.filter;
      chosen.channel = [&](const recording::Channel& channel) {
        return wanted.keeps(channel.topic) && (i == 0 || !is_carried_over(channel)) &&
               (!part.durable_only || is_durable(channel));
      };
      recording::MessageCursor cursor(reader, chosen);
      for (recording::Message message; cursor.next(message); ++read.samples)
        listener.take(reader.channels().at(message.channel_id), message, !part.durable_only);
      for (const std::string& problem : cursor.problems())
        notes << recordings[i].path.string() << ": " << problem << '\n';
      read.unread += cursor.problems().size();
    }
  }
  return read;
}

void check_any_read(const ReadFigures& read) {
  if (read.unread == 0 && read.samples == 0)
    throw std::runtime_error("no sample of the wanted topics is in the wanted range: nothing is written");
  if (read.unread > 0 && read.samples == 0)
    throw std::runtime_error("none of the " + std::to_string(read.unread) +
                             " chunks with the wanted samples can be read: nothing is written");
}

int exit_code_of(const ReadFigures& read, const std::string& made, std::ostream& notes) {
  if (read.unread == 0) return runtime::kExitDone;
  notes << read.unread << " chunks could not be read; " << made << " holds the rest\n";
  return runtime::kExitFailed;
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
