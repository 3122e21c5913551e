#pragma once

#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/command_answers.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// How one side stands to the stop, in words.
struct SideView {
  enum class Level {
    kQuiet,    ///< nothing to say
    kWaiting,  ///< asked, and not overdue yet
    kStopped,  ///< by its own word
    kAlarm     ///< has not confirmed, or is not stopped though the other side is
  };
  Level level = Level::kQuiet;
  std::string text;  ///< "stopped (emergency stop)", "HAS NOT CONFIRMED THE STOP"; ASCII

  friend bool operator==(const SideView&, const SideView&) = default;
};

/// What page and window show of a stop, whoever asked for it.
struct StopView {
  bool in_force = false;  ///< a stop is asked for, or a side is stopped
  bool alarm = false;     ///< a side has not confirmed it: to be shouted
  std::string headline;   ///< "EMERGENCY STOP", "STOP NOT CONFIRMED"; ASCII, empty: none
  std::array<SideView, core::kSides.size()> sides;  ///< by core::Side
  std::vector<std::string> notices;                 ///< "two processes send slave_state: …"

  friend bool operator==(const StopView&, const StopView&) = default;
};

/// "master: stopped (emergency stop) | slave: HAS NOT CONFIRMED THE STOP"
std::string sides_text(const StopView& view);

/// Who is stopped, by each side's own word, and who else sends what one process alone may send. Fed by the
/// topics' threads, asked by those of page, window and pictures, so that none of it waits for a picture.
/// Thread-safe.
class StopBoard {
 public:
  /// A side that has not been heard for so long is said to be silent.
  static constexpr core::Nanoseconds kSilent_ns = core::kNsPerSecond / 2;
  /// A second process is told of for so long after take_second().
  static constexpr core::Nanoseconds kSecond_ns = core::kNsPerSecond;

  /// Each state of the process that the viewer keeps to.
  void take_state(core::Side side, LinkState state, StopCause cause, std::uint64_t stop,
                  core::Nanoseconds received_ns);
  /// The stop that this viewer has asked for and that is not confirmed by all; empty: none.
  void take_request(const std::optional<core::CommandAnswers>& request);
  /// A process beside the one that the viewer keeps to has sent `topic`.
  void take_second(const std::string& topic, core::Nanoseconds received_ns);

  StopView at(core::Nanoseconds now_ns) const;
  /// The stop in force as the side's newest state names it; 0: none. For resets.
  std::uint64_t stop_of(core::Side side) const;

 private:
  struct State {
    core::Nanoseconds received_ns = 0;  // 0: never
    LinkState link = LinkState::kInit;
    StopCause cause = StopCause::kNone;
    std::uint64_t stop = 0;
    core::Nanoseconds moving_since_ns = 0;  // since when it says that it is not stopped
    bool stopped() const { return received_ns != 0 && link == LinkState::kStopped; }
  };
  SideView view_of(core::Side side, core::Nanoseconds now_ns) const;
  std::string headline(const StopView& view) const;
  bool stopped_by(StopCause cause) const;

  mutable std::mutex mutex_;
  std::array<State, core::kSides.size()> states_{};
  core::Nanoseconds stopped_since_ns_ = 0;  // since when any side is; 0: none is
  std::optional<core::CommandAnswers> request_;
  std::map<std::string, core::Nanoseconds> seconds_;  // topic → when a second process was heard
};

}  // namespace phantom::synthetic_viewer
