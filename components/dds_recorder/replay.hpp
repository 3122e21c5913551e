#pragma once

#include <map>

#include "common/core/clock.hpp"
#include "components/dds_recorder/files.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// `dds_recorder replay`.
struct ReplayRequest {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> topics;  ///< patterns; none: all
  std::vector<std::string> remap;   ///< "OLD:=NEW"
  TimeRange range;
  double rate = 1.0;         ///< 2: twice as fast; 0: as fast as it goes
  int loops = 1;             ///< 0: until stopped
  bool fresh_stamps = true;  ///< samples are stamped as if they were made now; else as they were recorded
  bool commands = false;     ///< also the topics that command something
  bool beside_live = false;  ///< also on topics that somebody else writes now
  double wait_s = 2.0;       ///< for readers, before it begins; it begins at once when every topic has one
};

/// Checks what can be checked without the files. Throws ConfigError naming the argument.
void validate(const ReplayRequest& request);
/// Old names → new ones. Throws ConfigError.
std::map<std::string, std::string> parse_remap(const std::vector<std::string>& remap);

/// Whether the topic commands something (an arm, a workspace, …) rather than telling of it.
bool is_command(const std::string& topic);

/// The topics that the request means, by their recorded names; inside with their new ones.
std::map<std::string, TopicInfo> topics_to_replay(const std::vector<OpenedRecording>& recordings,
                                                  const ReplayRequest& request);

/// Takes the samples in their turn.
class ReplaySink {
 public:
  virtual ~ReplaySink() = default;
  /// A new turn of the loop begins at `now_ns`.
  virtual void begin(core::Nanoseconds now_ns) = 0;
  /// `topic`: as it was recorded. `due_ns`: when this was to happen. False if it could not be sent.
  virtual bool write(const std::string& topic, const recording::Message& message,
                     core::Nanoseconds due_ns) = 0;
};

/// The time in which a replay runs; the process's clock, or a test's.
class ReplayClock {
 public:
  virtual ~ReplayClock() = default;
  virtual core::Nanoseconds now_ns() = 0;
  /// Returns at `at_ns`, at once if that is past; false if the replay is to end.
  virtual bool sleep_until(core::Nanoseconds at_ns) = 0;
};

struct ReplayFigures {
  std::uint64_t samples = 0, failed = 0, loops = 0;
  core::Nanoseconds worst_lateness_ns = 0;
  std::vector<std::string> problems;  ///< chunks that could not be read
};

/// Gives the sink every sample that the request means, each when it is due: log times ÷ rate. What of durable
/// topics came before the range comes first, without waiting. Until the end or until the clock says so.
ReplayFigures replay(const std::vector<OpenedRecording>& recordings, const ReplayRequest& request,
                     ReplaySink& sink, ReplayClock& clock);

}  // namespace phantom::dds_recorder
