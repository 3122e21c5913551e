#pragma once

#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/teleop/commands/command_answers.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/localized_text.hpp"

namespace phantom::synthetic_viewer {

/// The state of one side during a stop, as text.
struct SideView {
  enum class Level {
    kQuiet,    ///< nothing to say
    kWaiting,  ///< asked to stop; its answer is not overdue yet
    kStopped,  ///< stopped, by its own report
    kAlarm     ///< has not confirmed the stop, or is not stopped though the other side is
  };
  Level level = Level::kQuiet;
  std::string text;       ///< "stopped (emergency stop)", "HAS NOT CONFIRMED THE STOP"; ASCII
  LocalizedText words{};  ///< the same, for page, pictures and window

  friend bool operator==(const SideView&, const SideView&) = default;
};

/// What page and window show about a stop, whoever requested it.
struct StopView {
  bool in_force = false;           ///< a stop is requested, or a side is stopped
  bool alarm = false;              ///< a side has not confirmed it: shown as an alarm
  std::string headline;            ///< "EMERGENCY STOP", "STOP NOT CONFIRMED"; ASCII, empty: none
  LocalizedText headline_words{};  ///< the same, for page, pictures and window
  std::array<SideView, teleop::kSides.size()> sides;  ///< by teleop::Side
  /// "two processes send slave_state: …"; at most StopStatus::kMaxSeconds, and one of how many more there are
  std::vector<std::string> notices;
  std::vector<LocalizedText> notice_words{};  ///< the same, for page, pictures and window

  friend bool operator==(const StopView&, const StopView&) = default;
};

/// Returns the states of both sides: "master: stopped (emergency stop) | slave: HAS NOT CONFIRMED THE STOP".
std::string sides_text(const StopView& view, Language language = Language::kEnglish,
                       const char* between = " | ");

/// Keeps which sides are stopped, by each side's own report, and which topics a second process sends that
/// only one may send. The topics' threads write it; the threads of page, window and pictures read it, so that
/// a stop is shown without waiting for a picture. Thread-safe.
class StopStatus {
 public:
  /// A side that has not been heard for this long is shown as silent.
  static constexpr core::Nanoseconds kSilent_ns = core::kNsPerSecond / 2;
  /// A second process is reported for this long after take_second().
  static constexpr core::Nanoseconds kSecond_ns = core::kNsPerSecond;
  /// At most so many second processes are reported at a time, with how often others were heard meanwhile.
  static constexpr std::size_t kMaxSeconds = 16;

  StopStatus() = default;
  /// A copy goes on by itself.
  StopStatus(const StopStatus& other) { *this = other; }
  StopStatus& operator=(const StopStatus& other);
  ~StopStatus() = default;

  /// Takes each state of a side, from the process that the viewer follows.
  void take_state(teleop::Side side, LinkState state, StopCause cause, std::uint64_t stop,
                  core::Nanoseconds received_ns);
  /// Sets the stop that this viewer has requested and that not all have confirmed; empty: none.
  void take_request(const std::optional<teleop::CommandAnswers>& request);
  /// Reports that a process other than the followed one has sent `topic`.
  void take_second(const std::string& topic, core::Nanoseconds received_ns);

  StopView at(core::Nanoseconds now_ns) const;
  /// Returns the stop in force as the side's newest state names it; 0: none. For resets.
  std::uint64_t stop_of(teleop::Side side) const;
  /// Returns how often a second process was heard and not reported by name, as there were too many.
  std::uint64_t forgotten() const;

 private:
  struct State {
    core::Nanoseconds received_ns = 0;  // 0: never
    LinkState link = LinkState::kInit;
    StopCause cause = StopCause::kNone;
    std::uint64_t stop = 0;
    core::Nanoseconds moving_since_ns = 0;  // since when it reports that it is not stopped
    bool stopped() const { return received_ns != 0 && link == LinkState::kStopped; }
  };
  SideView view_of(teleop::Side side, core::Nanoseconds now_ns) const;
  LocalizedText headline(const StopView& view) const;
  bool stopped_by(StopCause cause) const;

  mutable std::mutex mutex_;
  std::array<State, teleop::kSides.size()> states_{};
  core::Nanoseconds stopped_since_ns_ = 0;  // since when any side is stopped; 0: none is
  std::optional<teleop::CommandAnswers> request_;
  std::map<std::string, core::Nanoseconds> seconds_;  // topic → when a second process was heard
  core::Nanoseconds crowded_ns_ = 0;                  // when there was last one too many of them; 0: never
  std::uint64_t forgotten_ = 0;
};

}  // namespace phantom::synthetic_viewer
