#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/fusion/depth_image.hpp"

namespace phantom::workspace_camera {

/// A depth camera that OpenNI 2 knows, such as those of PrimeSense, Asus and Orbbec.
struct OpenNiOptions {
  std::string device;  ///< its URI, or a recording's file (*.oni); empty: the first device that is found
  int width_px = 640, height_px = 480;  ///< as asked of the device
  int rate_hz = 30;                     ///< likewise
  double focal_px = 0.0;                ///< of both axes; 0: by the field of view that the device tells
  double latency_s = 0.03;              ///< from the exposure until the image is here
  double min_depth_m = 0.4, max_depth_m = 4.0;

  bool is_recording() const { return device.ends_with(".oni"); }
};

/// Reads a device on a thread of its own, which outlives it. A device that is missing, or sends nothing for a
/// second, is opened again each second. Of its images the newest waits. The images are as the camera sees
/// them: OpenNI's mirroring is undone.
class OpenNiCamera {
 public:
  struct Image {
    fusion::PinholeCamera camera;
    core::Nanoseconds received_ns = 0;
    std::vector<std::uint16_t> depth_mm;
  };

  /// Loads OpenNI's drivers, if no other camera has; it changes the working directory meanwhile. Throws
  /// core::MissingError if there is none.
  explicit OpenNiCamera(OpenNiOptions options);
  ~OpenNiCamera();
  OpenNiCamera(const OpenNiCamera&) = delete;
  OpenNiCamera& operator=(const OpenNiCamera&) = delete;

  /// Begins to read. `arrived` is called on the camera's thread after each image, until this is destroyed.
  void start(std::function<void()> arrived);
  /// Returns the newest image, each once. Any thread.
  std::optional<Image> take();
  /// Returns why no images come; empty while they do. Any thread.
  std::string trouble() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_camera
