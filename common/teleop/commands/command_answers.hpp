#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "common/core/clock.hpp"
#include "common/teleop/commands/stop_requests.hpp"

namespace phantom::teleop {

/// The two sides that carry out an operator's commands. Each side answers for itself.
enum class Side { kMaster, kSlave };
inline constexpr std::array<Side, 2> kSides{Side::kMaster, Side::kSlave};
/// Returns the name of the side's executable: "master_io" or "slave_io".
const char* component_of(Side side) noexcept;

/// One side's answer to a command.
struct SideAnswer {
  enum class State {
    kNotAsked,  ///< the command is not for this side
    kWaiting,   ///< the side has not answered yet
    kDone,      ///< confirmed by the side's own reply, or by its state, which reports that it is stopped
    kRefused    ///< the side refused; `message` says why, and what is allowed
  };
  State state = State::kNotAsked;
  std::string message;                     ///< the text of the side's reply
  core::Nanoseconds waiting_since_ns = 0;  ///< CLOCK_MONOTONIC
};

/// Collects both sides' answers to one command. A plain value: the caller passes the times in. Not for the
/// real-time path.
class CommandAnswers {
 public:
  /// A side must confirm a stop within this time; after it, the answer is overdue.
  static constexpr core::Nanoseconds kOverdue_ns = kStopConfirmedWithin_ns;
  /// A state sample confirms a stop only if it arrives at least this long after the request. An earlier
  /// sample may have been under way before the request, and may report another stop that has been released
  /// since.
  static constexpr core::Nanoseconds kUnderWay_ns = 100 * core::kNsPerMillisecond;

  CommandAnswers() = default;
  CommandAnswers(bool asks_master, bool asks_slave, core::Nanoseconds asked_ns);

  /// Records that side's reply to this command. A refusal may be followed by `done`, but never the other way
  /// round.
  void take_reply(Side side, bool done, const std::string& message);
  /// For a stop: records that the side's own state, received at `received_ns`, reports it as stopped.
  void take_stopped(Side side, core::Nanoseconds received_ns);
  /// For a stop that is requested again before `earlier` was confirmed: a side that has not yet confirmed
  /// `earlier` keeps the time since which it has been waited for.
  void keep_waiting_since(const CommandAnswers& earlier);

  const SideAnswer& of(Side side) const { return sides_[static_cast<std::size_t>(side)]; }
  core::Nanoseconds asked_ns() const { return asked_ns_; }
  /// Returns whether every side that was asked has done it.
  bool done() const;
  /// Returns whether every side that was asked has either done or refused it.
  bool answered() const;
  bool refused() const;
  /// Returns whether the side was asked more than kOverdue_ns ago and has not done it.
  bool overdue(Side side, core::Nanoseconds now_ns) const;

 private:
  SideAnswer& at(Side side) { return sides_[static_cast<std::size_t>(side)]; }

  std::array<SideAnswer, kSides.size()> sides_{};
  core::Nanoseconds asked_ns_ = 0;
};

/// Describes the answers to a stop: "stopped: master_io, slave_io"; "NOT CONFIRMED by slave_io; stopped:
/// master_io"; "slave_io REFUSED the stop: …".
std::string stop_words(const CommandAnswers& answers);
/// Describes the answers to any other command by the replies' messages: "master_io: …; slave_io: …", "no
/// answer from slave_io"; "sent" if nobody has to answer it.
std::string command_words(const CommandAnswers& answers);

}  // namespace phantom::teleop
