#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/camera/lens.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer {

/// What a calibration found.
struct Calibration {
  std::optional<camera::Lens> lens;
  std::optional<geometry::Pose> X_WC;  ///< frame C as that of a camera::Lens
  double lens_residual_px = 0.0;
  double pose_residual_px = 0.0, pose_residual_mm = 0.0;
  double pose_sigma_mm = 0.0, pose_sigma_deg = 0.0;
  bool has_figures = false;  ///< the numbers above were measured
};

enum class VideoKind { kDevice, kFile, kPictures, kTopic, kSimulated };

/// The checked content of a camera's file.
struct VideoCamera {
  std::string name;
  VideoKind kind = VideoKind::kDevice;
  std::filesystem::path path;
  double rate_hz = 10.0;
  std::optional<double> latency_s;  ///< exposure to arrival; none: not known
  Calibration calibration;
  /// Where a new calibration is written: the file that this camera's file names, else NAME_calibration.yaml
  /// beside NAME.yaml.
  std::filesystem::path calibration_file;
  bool names_calibration = false;
  /// How the simulated camera differs from the ideal one.
  struct Simulated {
    double latency_s = 0.12, exposure_s = 0.0, gain = 1.0;
    double noise = 2.0;  ///< standard deviation of each value, of 255
    bool stamped = true;
    geometry::Pose X_CS;  ///< real camera S, seen from where the calibration has it
  } simulated;

  bool calibrated() const { return calibration.lens.has_value() && calibration.X_WC.has_value(); }
};

extern const char* const kVideoCameraKeys;  ///< video_camera.yaml, which defines the keys

/// Reads and checks a camera's file and the calibration that it names. Throws core::ConfigError,
/// core::MissingError.
VideoCamera load_video_camera(const std::filesystem::path& path);

/// Reads and checks a file of write_calibration(). Throws core::ConfigError, core::MissingError.
Calibration load_calibration(const std::filesystem::path& path);

/// Writes a calibration; another process sees the old file or the whole new one. Throws core::MissingError.
void write_calibration(const std::filesystem::path& path, const Calibration& calibration);

}  // namespace phantom::synthetic_viewer
