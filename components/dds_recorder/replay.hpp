#pragma once

#include <map>

#include "common/core/clock.hpp"
#include "components/dds_recorder/files.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// The arguments of `dds_recorder replay`.
struct ReplayRequest {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> topics;  ///< patterns; empty: all
  std::vector<std::string> remap;   ///< "OLD:=NEW"
  TimeRange range;
  double rate = 1.0;         ///< 2: twice as fast; 0: as fast as it goes
  int loops = 1;             ///< 0: until stopped
  bool fresh_stamps = true;  ///< stamps as if the samples were made now; false: as recorded
  bool commands = false;     ///< also replays topics that command something
  bool beside_live = false;  ///< also replays topics that another process writes now
  double wait_s = 2.0;       ///< longest wait for readers before the start; less when every topic has one
};

/// Checks what can be checked without the files. Throws ConfigError that names the argument.
void validate(const ReplayRequest& request);
/// Returns a map from old to new names. Throws ConfigError.
std::map<std::string, std::string> parse_remap(const std::vector<std::string>& remap);

/// Returns whether the topic commands something (an arm, a workspace, …) and does not only report.
bool is_command(const std::string& topic);

/// Returns the requested topics by their recorded names. Each TopicInfo has the new name.
std::map<std::string, TopicInfo> topics_to_replay(const std::vector<OpenedRecording>& recordings,
                                                  const ReplayRequest& request);

/// Receives the samples of a replay in their order.
class ReplaySink {
 public:
  virtual ~ReplaySink() = default;
  /// Begins a new turn of the loop at `now_ns`.
  virtual void begin(core::Nanoseconds now_ns) = 0;
  /// Sends a sample. `topic`: its recorded name. `due_ns`: when it was due. Returns false if it could not be
  /// sent.
  virtual bool write(const std::string& topic, const recording::Message& message,
                     core::Nanoseconds due_ns) = 0;
};

/// The clock of a replay: the process's, or a test's.
class ReplayClock {
 public:
  virtual ~ReplayClock() = default;
  virtual core::Nanoseconds now_ns() = 0;
  /// Returns true at `at_ns`, at once if that is past; false if the replay is to end.
  virtual bool sleep_until(core::Nanoseconds at_ns) = 0;
};

struct ReplayFigures {
  std::uint64_t samples = 0, failed = 0, loops = 0;
  core::Nanoseconds worst_lateness_ns = 0;
  std::vector<std::string> problems;  ///< chunks that could not be read
};

/// Passes every requested sample to the sink when it is due: log times ÷ rate. Samples of durable topics from
/// before the range come first, without waiting. Runs until the end, or until the clock says to end.
ReplayFigures replay(const std::vector<OpenedRecording>& recordings, const ReplayRequest& request,
                     ReplaySink& sink, ReplayClock& clock);

}  // namespace phantom::dds_recorder
