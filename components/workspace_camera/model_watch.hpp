#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "components/workspace_camera/camera_alignment.hpp"
#include "components/workspace_camera/config.hpp"
#include "components/workspace_camera/pose_checker.hpp"

namespace phantom::workspace_camera {

/// Compares images with the model: objects that do not stand where the model has them, fixed cameras that
/// were knocked, and cameras that are covered. While a camera is knocked, what it says of objects does not
/// count. One thread.
class ModelWatch {
 public:
  /// `X_WO`: where the model has each object.
  ModelWatch(const WorkspaceCameraConfig& config, std::vector<ModelObject> objects, std::vector<Place> X_WO);

  /// Takes where the model has an object now; nothing: it is not in the workspace.
  void place(std::uint16_t id, const Place& X_WO);
  /// Takes what arms carry: it stands nowhere.
  void set_carried(const std::set<std::uint16_t>& ids);
  /// Takes an image that was fused. Returns whether a camera was just found to be knocked or covered, or no
  /// longer.
  bool take(std::size_t camera, const fusion::DepthImage& image, std::span<const float> arm_depth_m,
            core::Nanoseconds now_ns);
  /// Returns what is confirmed of each object (ConfirmedFindings::reported()).
  std::vector<ConfirmedFinding> findings() const { return checker_.findings(); }
  /// Returns a sentence for each object and camera of which the pose is wrong.
  std::vector<std::string> sentences() const;

  /// How often a camera's own pose is looked at: knocks are reported within three of these and a status.
  static constexpr core::Nanoseconds kKnockPeriod_ns = 120 * core::kNsPerMillisecond;

 private:
  struct Camera {
    std::string name;
    bool fixed = true, drawn = false;
    CameraAlignment alignment;
    KnockWatch watch;
    CoverWatch cover;
    core::Nanoseconds due_ns = 0;
  };

  void draw(Camera& camera, const fusion::DepthImage& image) const;
  void pass(std::size_t object);
  Place place_of(std::size_t object) const;
  std::vector<Place> places() const;

  const std::vector<ModelObject> objects_;
  std::vector<Place> X_WO_;
  std::set<std::uint16_t> carried_;
  std::vector<Camera> cameras_;
  PoseChecker checker_;
};

}  // namespace phantom::workspace_camera
