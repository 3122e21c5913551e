#include "common/messages/operator_client.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "common/core/thread_config.hpp"

namespace phantom::messages {

using teleop::Side;

OperatorClient::OperatorClient(dds::Participant& participant, OnStop on_stop)
    : stamper_(participant),
      on_stop_(std::move(on_stop)),
      writer_(participant, dds::kOperatorCommand),
      replies_(participant, dds::kOperatorReply,
               [this](const msg::OperatorReply& message, const dds::SampleInfo& info) {
                 if (const auto reply = from_idl(message)) take_reply(*reply, info.received_ns);
               }),
      thread_([this] {
        core::apply_thread_config(core::ThreadRole::kRequests);
        repeat();
      }) {}

OperatorClient::~OperatorClient() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::uint64_t OperatorClient::send(const OperatorCommand& command, double repeat_s) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  Request request;
  request.command = to_idl(command);
  request.answers = {teleop::asks(command.kind, Side::kMaster), teleop::asks(command.kind, Side::kSlave),
                     now_ns};
  {
    const std::lock_guard lock(mutex_);
    request.command.stamp(stamper_.next());
    request.number = request.command.stamp().sequence_number();
    request.sent_ns = now_ns;
    request.repeat_until_ns = now_ns + core::from_seconds(repeat_s);
    request.repeats = !request.finished();
    if (const Request* owed = unconfirmed(); owed != nullptr && request.is_stop())
      request.answers.keep_waiting_since(owed->answers);
    end_repeats_for(request);
    requests_.push_back(request);
    if (requests_.size() > kRemembered) forget_one();
    publish_stop();
  }
  changed_.notify_all();
  // Without the lock, so that a write that blocks holds up no other caller.
  writer_.write(request.command);
  return request.number;
}

void OperatorClient::end_repeats_for(const Request& newer) {
  if (!newer.repeats) return;
  const bool is_reset = newer.command.kind() == msg::CommandKind::COMMAND_RESET;
  if (is_reset) released_ = {newer.command.master_stop(), newer.command.slave_stop()};
  for (Request& older : requests_) {
    if (!older.repeats || (older.is_stop() && !is_reset && !newer.is_stop())) continue;
    older.repeats = false;
  }
}

teleop::CommandAnswers OperatorClient::wait(std::uint64_t number, double timeout_s) {
  std::unique_lock lock(mutex_);
  const Request* request = find(number);
  if (request == nullptr) return {};
  changed_.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    request = find(number);
    return request == nullptr || request->finished();
  });
  return request == nullptr ? teleop::CommandAnswers() : request->answers;
}

void OperatorClient::take_reply(const OperatorReply& reply, core::Nanoseconds received_ns) {
  const std::lock_guard lock(mutex_);
  for (const Side side : teleop::kSides) {
    if (reply.component != teleop::component_of(side)) continue;
    const Source& source = sources_[static_cast<std::size_t>(side)];
    const bool bound = source.heard_ns != 0 && received_ns - source.heard_ns < kBound_ns;
    if (bound && source.session != reply.stamp.session) return;
    Request* request = find(reply.command.sequence_number);
    if (request == nullptr || request->command.stamp().session() != reply.command.session) return;
    request->answers.take_reply(side, reply.done, reply.message);
    finish_if_done(*request);
  }
}

void OperatorClient::take_state(Side side, std::uint64_t session, std::uint64_t stop,
                                core::Nanoseconds received_ns) {
  const std::lock_guard lock(mutex_);
  const auto index = static_cast<std::size_t>(side);
  sources_[index] = {session, received_ns};
  if (stop == 0 || stop == released_[index]) return;
  for (Request& request : requests_) {
    if (!request.is_stop() || !request.repeats) continue;
    request.answers.take_stopped(side, received_ns);
    finish_if_done(request);
  }
}

void OperatorClient::finish_if_done(Request& request) {
  if (request.finished()) request.repeats = false;
  if (request.is_stop()) publish_stop();
  changed_.notify_all();
}

void OperatorClient::publish_stop() {
  if (!on_stop_) return;
  const Request* stop = unconfirmed();
  on_stop_(stop == nullptr ? std::nullopt : std::optional(stop->answers));
}

std::optional<teleop::CommandAnswers> OperatorClient::unconfirmed_stop() const {
  const std::lock_guard lock(mutex_);
  const Request* stop = unconfirmed();
  return stop == nullptr ? std::nullopt : std::optional(stop->answers);
}

OperatorClient::Request* OperatorClient::find(std::uint64_t number) {
  const auto found = std::find_if(requests_.begin(), requests_.end(),
                                  [number](const Request& request) { return request.number == number; });
  return found == requests_.end() ? nullptr : &*found;
}

/// Forgets the oldest request, but never an unconfirmed stop.
void OperatorClient::forget_one() {
  const auto oldest = std::find_if(requests_.begin(), requests_.end(), [](const Request& request) {
    return !request.is_stop() || !request.repeats;
  });
  if (oldest != requests_.end()) requests_.erase(oldest);
}

const OperatorClient::Request* OperatorClient::unconfirmed() const {
  const auto found = std::find_if(requests_.rbegin(), requests_.rend(), [](const Request& request) {
    return request.is_stop() && request.repeats;
  });
  return found == requests_.rend() ? nullptr : &*found;
}

void OperatorClient::repeat() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    core::Nanoseconds due_ns = now_ns + core::kNsPerSecond;
    std::vector<msg::OperatorCommand> again;
    for (Request& request : requests_) {
      if (!request.repeats) continue;
      if (!request.is_stop() && now_ns >= request.repeat_until_ns) {
        request.repeats = false;
        continue;
      }
      if (now_ns - request.sent_ns >= kAgain_ns) {
        request.sent_ns = now_ns;
        again.push_back(request.command);
      }
      due_ns = std::min(due_ns, request.sent_ns + kAgain_ns);
    }
    if (again.empty()) {
      changed_.wait_for(lock, std::chrono::nanoseconds(due_ns - now_ns));
      continue;
    }
    lock.unlock();
    for (const msg::OperatorCommand& command : again) writer_.write(command);
    lock.lock();
  }
}

}  // namespace phantom::messages
