#include "components/wva_server/command_desk.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>

namespace phantom::wva_server {

Reply CommandDesk::take_in(Request request) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(known_.begin(), known_.end(),
                                  [&](const auto& entry) { return entry.first == request.id; });
  if (known != known_.end()) return known->second;
  Reply reply;
  reply.object = request.command.object;
  reply.object_id = request.command.id;
  if (waiting_.size() >= kMostWaiting) {
    reply.outcome = Outcome::kRefused;
    reply.message = fmt::format("{} commands are waiting already; send it again later", waiting_.size());
    return reply;
  }
  reply.message =
      waiting_.empty() ? "taken up" : fmt::format("waits for {} commands before it", waiting_.size());
  known_.emplace_back(request.id, reply);
  if (known_.size() > kMostRemembered) known_.pop_front();
  waiting_.push_back(std::move(request));
  came_.notify_one();
  return reply;
}

std::optional<Request> CommandDesk::next(double wait_s) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return !waiting_.empty(); });
  if (waiting_.empty()) return std::nullopt;
  Request request = std::move(waiting_.front());
  waiting_.pop_front();
  return request;
}

void CommandDesk::replied(const CommandId& id, const Reply& reply) {
  const std::lock_guard lock(mutex_);
  for (auto& [known, last] : known_) {
    if (known == id) last = reply;
  }
}

}  // namespace phantom::wva_server
