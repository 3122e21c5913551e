#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "components/synthetic_viewer/render/feature_edges.hpp"
#include "components/synthetic_viewer/render/ray_scene.hpp"
#include "components/synthetic_viewer/video/picture_warp.hpp"
#include "components/synthetic_viewer/video/video_camera.hpp"
#include "components/synthetic_viewer/video/video_feed.hpp"

namespace phantom::synthetic_viewer {

/// A corner whose place the model knows: of an object's mesh (corner_towards()).
struct KnownCorner {
  std::string name;  ///< "work_table:+-+", as `calibrate --pick` has it
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
};

/// Appends the known corners of an object whose edges are `mesh`, in its frame. Pure.
void add_known_corners(const std::string& object, const geometry::Pose& X_WO, const EdgeMesh& mesh,
                       std::vector<KnownCorner>& corners);

/// What the page asks: the pose that picks give is tried, what is tried is kept, or discarded.
struct CalibrationRequest {
  enum class Act : std::uint8_t { kTry, kKeep, kDiscard };
  struct Pick {
    std::string corner;
    double u = 0.0, v = 0.0;  ///< 0…1 of the picture's width and height, from its upper left
  };
  static constexpr std::size_t kMaxPicks = 32;
  Act act = Act::kTry;
  std::vector<Pick> picks;
  std::uint64_t trial = 0;  ///< which pose is kept or discarded: two pages may be at it
};

/// Parses {"try": [{"corner": "work_table:+-+", "at": [0.31, 0.62]}, …]}, {"keep": 3} or {"discard": 3}, with
/// the number of the pose on trial. The error says what is wrong and what is allowed.
core::Expected<CalibrationRequest> parse_calibration_request(const std::string& json);

/// Where a real camera's pose is found by picks on the page. A pose is tried before it is kept: everybody
/// sees the model drawn by it. Thread-safe.
class PoseCalibration {
 public:
  /// `camera`: calibrated; `width_px`, `height_px`: of the pictures that are shown, without distortion.
  /// `camera` must outlive this.
  PoseCalibration(const VideoCamera& camera, int width_px, int height_px);

  // For the viewer.
  /// Sets where pictures come from; null: from nowhere any more.
  void attach(const VideoFeed* feed);
  /// Returns whether the page has asked for the state in the last seconds.
  bool open(core::Nanoseconds now_ns) const;
  /// Sets the corners that are known now, and what may hide them.
  void show(std::vector<KnownCorner> corners, const RayScene& obstacles);
  /// Returns the calibration by which the model is drawn, and whether it is on trial.
  Calibration in_force(bool& on_trial) const;

  // For the page's threads.
  /// Returns the response to GET /calibration, and keeps open() true for some seconds.
  std::string state_json(core::Nanoseconds now_ns);
  /// Returns the newest picture without distortion and without the model, as JPEG; an error if there is none
  /// or it is old.
  core::Expected<std::string> still(core::Nanoseconds now_ns) const;
  /// Carries out a request. Returns what to tell, or why it is refused; then nothing has changed.
  core::Expected<std::string> carry_out(const CalibrationRequest& request);

 private:
  struct Trial {
    std::uint64_t number = 0;
    Calibration calibration;
    std::size_t points = 0;
    double worst_px = 0.0;
  };
  struct Corner {
    KnownCorner known;
    bool seen = false;  ///< nothing hides it from where the camera stands
  };
  core::Expected<std::string> try_pose(const CalibrationRequest& request);
  core::Expected<std::string> keep(std::uint64_t number);
  core::Expected<Trial> on_trial(std::uint64_t number) const;
  const Calibration& standing() const { return trial_ ? trial_->calibration : kept_; }

  const VideoCamera& camera_;
  const camera::LensModel lens_;
  const camera::LensModel straight_;
  const PictureWarp warp_;
  std::mutex keep_mutex_;     // one writes the file at a time, without holding the drawing up
  mutable std::mutex mutex_;  // for what follows
  const VideoFeed* feed_ = nullptr;
  core::Nanoseconds asked_ns_ = 0;
  std::vector<Corner> corners_;
  Calibration kept_;
  std::optional<Trial> trial_;
  std::uint64_t trials_ = 0;  // so far
};

}  // namespace phantom::synthetic_viewer
