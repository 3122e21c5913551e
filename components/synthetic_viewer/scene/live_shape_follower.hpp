#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "common/workspace/workspace.hpp"
#include "components/synthetic_viewer/state/inbox.hpp"

namespace phantom::synthetic_viewer {

/// Keeps the inbox's live shapes up to date for the viewer's own pictures, twice a second, on a thread of its
/// own, and only while the viewer's loop knows of live matter.
class LiveShapeFollower {
 public:
  /// Returns the newest whole workspace; null: none has come yet.
  using Find = std::function<std::shared_ptr<const workspace::Workspace>()>;

  /// `inbox` must outlive this.
  LiveShapeFollower(Inbox& inbox, Find find);
  ~LiveShapeFollower();
  LiveShapeFollower(const LiveShapeFollower&) = delete;
  LiveShapeFollower& operator=(const LiveShapeFollower&) = delete;

 private:
  void run();
  void look();

  Inbox& inbox_;
  const Find find_;
  bool shown_ = false;         // used on the thread only, as the one below
  std::uint64_t version_ = 0;  // of the workspace that is shown
  std::mutex mutex_;
  std::condition_variable wake_;
  bool end_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
