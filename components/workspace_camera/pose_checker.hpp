#pragma once

#include <condition_variable>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/core/clock.hpp"
#include "components/workspace_camera/confirmed_findings.hpp"
#include "components/workspace_camera/pose_check.hpp"

namespace phantom::workspace_camera {

/// Runs PoseCheck on a thread of its own, so that fusion does not wait for it: an image of each camera every
/// `every_s`, as far as the thread is free. The other functions are called by one thread.
class PoseChecker {
 public:
  PoseChecker(const PoseCheckRules& rules, std::vector<ModelObject> objects);
  ~PoseChecker();
  PoseChecker(const PoseChecker&) = delete;
  PoseChecker& operator=(const PoseChecker&) = delete;

  /// Takes where an object is now; nothing: it is not in the workspace. Objects that are not checked are left
  /// out. What was said of one that has moved is forgotten.
  void place(std::uint16_t id, const Place& X_WO);
  /// Forgets what a camera has shown.
  void forget_camera(std::size_t camera);
  /// Offers the newest image of a camera; it is copied if it is due.
  void offer(std::size_t camera, const fusion::DepthImage& image, std::span<const float> arm_depth_m,
             core::Nanoseconds now_ns);
  /// Returns what is confirmed of each object (ConfirmedFindings::reported()).
  std::vector<ConfirmedFinding> findings() const;

 private:
  void run(const std::stop_token& stop);

  const PoseCheckRules rules_;
  PoseCheck check_;  // of the thread
  const std::vector<std::uint16_t> ids_;
  std::vector<core::Nanoseconds> due_ns_;  // by camera

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any wanted_;
  bool busy_ = false;
  std::size_t camera_ = 0;
  bool forgotten_ = false;  // the camera whose image is looked at
  fusion::DepthImage image_;
  std::vector<float> arm_depth_m_;
  std::vector<Place> places_;  // by object
  ConfirmedFindings confirmed_;
  std::jthread thread_;
};

}  // namespace phantom::workspace_camera
