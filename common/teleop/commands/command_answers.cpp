#include "common/teleop/commands/command_answers.hpp"

#include <algorithm>

#include "common/core/text.hpp"

namespace phantom::teleop {

using State = SideAnswer::State;

const char* component_of(Side side) noexcept { return side == Side::kMaster ? "master_io" : "slave_io"; }

CommandAnswers::CommandAnswers(bool asks_master, bool asks_slave, core::Nanoseconds asked_ns)
    : asked_ns_(asked_ns) {
  if (asks_master) at(Side::kMaster) = {State::kWaiting, {}, asked_ns};
  if (asks_slave) at(Side::kSlave) = {State::kWaiting, {}, asked_ns};
}

void CommandAnswers::take_reply(Side side, bool done, const std::string& message) {
  SideAnswer& answer = at(side);
  if (answer.state == State::kNotAsked || answer.state == State::kDone) return;
  answer.state = done ? State::kDone : State::kRefused;
  answer.message = message;
}

void CommandAnswers::take_stopped(Side side, core::Nanoseconds received_ns) {
  SideAnswer& answer = at(side);
  if (answer.state == State::kNotAsked || answer.state == State::kDone) return;
  if (received_ns - asked_ns_ < kUnderWay_ns) return;
  answer.state = State::kDone;
  answer.message = "its state says that it is stopped";
}

void CommandAnswers::keep_waiting_since(const CommandAnswers& earlier) {
  for (const Side side : kSides) {
    const SideAnswer& before = earlier.of(side);
    if (before.state == State::kWaiting || before.state == State::kRefused)
      at(side).waiting_since_ns = before.waiting_since_ns;
  }
}

bool CommandAnswers::done() const {
  return std::all_of(sides_.begin(), sides_.end(), [](const SideAnswer& answer) {
    return answer.state == State::kNotAsked || answer.state == State::kDone;
  });
}

bool CommandAnswers::answered() const {
  return std::none_of(sides_.begin(), sides_.end(),
                      [](const SideAnswer& answer) { return answer.state == State::kWaiting; });
}

bool CommandAnswers::refused() const {
  return std::any_of(sides_.begin(), sides_.end(),
                     [](const SideAnswer& answer) { return answer.state == State::kRefused; });
}

bool CommandAnswers::overdue(Side side, core::Nanoseconds now_ns) const {
  const SideAnswer& answer = of(side);
  return (answer.state == State::kWaiting || answer.state == State::kRefused) &&
         now_ns - answer.waiting_since_ns > kOverdue_ns;
}

namespace {

/// Returns the names of the sides in that state: "master_io, slave_io".
std::string names(const CommandAnswers& answers, State state) {
  std::string text;
  for (const Side side : kSides)
    if (answers.of(side).state == state) core::add_to_list(text, component_of(side));
  return text;
}

void append(std::string& text, const std::string& part) { text += (text.empty() ? "" : "; ") + part; }

}  // namespace

std::string stop_words(const CommandAnswers& answers) {
  std::string text;
  for (const Side side : kSides) {
    const SideAnswer& answer = answers.of(side);
    if (answer.state == State::kRefused)
      append(text, std::string(component_of(side)) + " REFUSED the stop: " + answer.message);
  }
  if (const std::string waiting = names(answers, State::kWaiting); !waiting.empty())
    append(text, "NOT CONFIRMED by " + waiting);
  if (const std::string done = names(answers, State::kDone); !done.empty()) append(text, "stopped: " + done);
  return text;
}

std::string command_words(const CommandAnswers& answers) {
  std::string text;
  for (const Side side : kSides) {
    const SideAnswer& answer = answers.of(side);
    if (answer.state != State::kDone && answer.state != State::kRefused) continue;
    const char* instead = answer.state == State::kDone ? "done" : "refused";
    append(text,
           std::string(component_of(side)) + ": " + (answer.message.empty() ? instead : answer.message));
  }
  if (const std::string waiting = names(answers, State::kWaiting); !waiting.empty())
    append(text, "no answer from " + waiting);
  return text.empty() ? "sent" : text;
}

}  // namespace phantom::teleop
