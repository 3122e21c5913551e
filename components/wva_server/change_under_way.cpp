#include "components/wva_server/change_under_way.hpp"

#include <chrono>

#include "common/core/thread_config.hpp"

namespace phantom::wva_server {

ChangeUnderWay::ChangeUnderWay(LiveCell& cell, WorkspaceCommand command, std::uint64_t version,
                               layers::ActivationOptions options, bool (*must_end)())
    : command_(std::move(command)), object_(cell.name_in(command_)) {
  for (const auto& [id, object] : cell.objects()) {
    if (command_.object.empty() ? id == command_.id : object.config.name == command_.object) id_ = id;
  }
  doing_ = std::string(name_of(command_.operation)) + (object_.empty() ? " an object" : " '" + object_ + "'");
  options.keep_going = [this, must_end] { return !was_ended() && !must_end(); };
  options.on_progress = [this](double share) { share_.store(share, std::memory_order_relaxed); };
  thread_ = std::jthread([this, &cell, version, options = std::move(options)] {
    core::apply_thread_config(core::ThreadRole::kHelper);
    change_.emplace(cell.apply(command_, version, options));
    done_.release();
  });
}

bool ChangeUnderWay::is_overtaken_by(const WorkspaceCommand& later) const {
  if (later.operation != WorkspaceOperation::kMove && later.operation != WorkspaceOperation::kRemove)
    return false;
  if (command_.operation == WorkspaceOperation::kRemove) return false;  // takes no time
  const bool same = later.object.empty() ? id_ != 0 && later.id == id_ : later.object == object_;
  // An object that is not there yet cannot be moved.
  return same && !object_.empty() &&
         (command_.operation == WorkspaceOperation::kMove || later.operation == WorkspaceOperation::kRemove);
}

bool ChangeUnderWay::wait(double wait_s) {
  is_done_ = is_done_ || done_.try_acquire_for(std::chrono::duration<double>(wait_s));
  return is_done_;
}

}  // namespace phantom::wva_server
