#include "components/synthetic_viewer/scene/live_shape_follower.hpp"

#include <chrono>

#include "common/core/thread_config.hpp"
#include "components/synthetic_viewer/scene/live_shape.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::chrono::milliseconds kPeriod{500};

}  // namespace

LiveShapeFollower::LiveShapeFollower(Inbox& inbox, Find find)
    : inbox_(inbox), find_(std::move(find)), thread_([this] { run(); }) {}

LiveShapeFollower::~LiveShapeFollower() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LiveShapeFollower::run() {
  core::apply_thread_config(core::ThreadRole::kHelper);
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kPeriod, [this] { return end_; })) {
    lock.unlock();
    look();
    lock.lock();
  }
}

void LiveShapeFollower::look() {
  if (!inbox_.live_matter.load(std::memory_order_relaxed)) {
    if (shown_) inbox_.put_live_shapes({});
    shown_ = false;
    return;
  }
  const auto newest = find_();
  if (!newest || (shown_ && newest->version == version_)) return;
  inbox_.put_live_shapes(live_shapes(*newest));
  shown_ = true;
  version_ = newest->version;
}

}  // namespace phantom::synthetic_viewer
