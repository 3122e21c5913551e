#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/stop_requests.hpp"

namespace phantom::core {

/// The two sides that carry out an operator's commands and answer them, each for itself.
enum class Side { kMaster, kSlave };
inline constexpr std::array<Side, 2> kSides{Side::kMaster, Side::kSlave};
/// The executable that speaks for a side: "master_io", "slave_io".
const char* component_of(Side side) noexcept;

/// What one side has said to a command.
struct SideAnswer {
  enum class State {
    kNotAsked,  ///< the command is not for this side
    kWaiting,   ///< no word from it yet
    kDone,      ///< by its own word: reply, or state that says that it is stopped
    kRefused    ///< `message` says why, and what is allowed
  };
  State state = State::kNotAsked;
  std::string message;               ///< of its reply
  Nanoseconds waiting_since_ns = 0;  ///< CLOCK_MONOTONIC
};

/// Who has answered a command, and what. A plain value; times are passed in. Not for the real-time path.
class CommandAnswers {
 public:
  /// A side must have confirmed a stop within this time.
  static constexpr Nanoseconds kOverdue_ns = kStopConfirmedWithin_ns;
  /// A stop's confirmation by state: samples that came sooner may have been under way before the stop was
  /// asked for, when another one was in force that has been released since.
  static constexpr Nanoseconds kUnderWay_ns = 100 * kNsPerMillisecond;

  CommandAnswers() = default;
  CommandAnswers(bool asks_master, bool asks_slave, Nanoseconds asked_ns);

  /// A reply of that side to this command. A refusal may be followed by `done`, never the other way round.
  void take_reply(Side side, bool done, const std::string& message);
  /// For a stop: the side's own state, received at `received_ns`, says that it is stopped.
  void take_stopped(Side side, Nanoseconds received_ns);
  /// For a stop that is asked for again before `earlier` was confirmed: sides that still owe that
  /// confirmation have been waited for since then.
  void keep_waiting_since(const CommandAnswers& earlier);

  const SideAnswer& of(Side side) const { return sides_[static_cast<std::size_t>(side)]; }
  Nanoseconds asked_ns() const { return asked_ns_; }
  /// Every side that was asked has done it.
  bool done() const;
  /// Every side that was asked has said yes or no.
  bool answered() const;
  bool refused() const;
  /// Whether the side has been asked for longer than kOverdue_ns and has not done it.
  bool overdue(Side side, Nanoseconds now_ns) const;

 private:
  SideAnswer& at(Side side) { return sides_[static_cast<std::size_t>(side)]; }

  std::array<SideAnswer, kSides.size()> sides_{};
  Nanoseconds asked_ns_ = 0;
};

/// A stop's answers in words: "stopped: master_io, slave_io"; "NOT CONFIRMED by slave_io; stopped:
/// master_io"; "slave_io REFUSED the stop: …".
std::string stop_words(const CommandAnswers& answers);
/// Any other command's: the replies' messages, "master_io: …; slave_io: …", "no answer from slave_io"; "sent"
/// if nobody has to answer it.
std::string command_words(const CommandAnswers& answers);

}  // namespace phantom::core
