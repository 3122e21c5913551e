#include "components/synthetic_viewer/video/video_camera.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>

#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "common/percept/view_node.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::synthetic_viewer {
namespace {

using runtime::Fields;

const runtime::FieldTable& camera_table() {
  static const runtime::FieldTable table{kVideoCameraKeys};
  return table;
}

camera::Lens read_lens(const Fields& fields) {
  camera::Lens lens;
  std::vector<double> size, focal, centre, distortion{0, 0, 0, 0, 0};
  fields.numbers("size_px", size);
  fields.numbers("focal_px", focal);
  fields.numbers("centre_px", centre);
  fields.numbers("distortion", distortion);
  fields.check(size.size() == 2 && size[0] == std::floor(size[0]) && size[1] == std::floor(size[1]),
               "size_px", "must be two whole numbers: width and height");
  fields.check(focal.size() == 2, "focal_px", "must be two numbers: fx, fy");
  fields.check(centre.size() == 2, "centre_px", "must be two numbers: cx, cy");
  fields.check(distortion.size() == 5, "distortion", "must be five numbers: k1, k2, p1, p2, k3");
  lens = {static_cast<int>(size[0]),
          static_cast<int>(size[1]),
          focal[0],
          focal[1],
          centre[0],
          centre[1],
          distortion[0],
          distortion[1],
          distortion[2],
          distortion[3],
          distortion[4]};
  const std::string fault = camera::fault_of(lens);
  fields.check(fault.empty(), "distortion", fault);
  return lens;
}

/// Returns the pose of an upright camera.
geometry::Pose looking_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m) {
  const Eigen::Matrix3d rows = percept::view_axes((eye_m - target_m).normalized());  // right, up, away
  geometry::Pose X_WC;
  X_WC.rotation << rows.row(0).transpose(), -rows.row(1).transpose(), -rows.row(2).transpose();
  X_WC.translation_m = eye_m;
  return X_WC;
}

void read_simulated(const Fields& fields, VideoCamera::Simulated& simulated) {
  fields.number("latency_ms", simulated.latency_s, 1e-3);
  fields.number("exposure_ms", simulated.exposure_s, 1e-3);
  fields.flag("stamped", simulated.stamped);
  fields.number("gain", simulated.gain);
  fields.number("noise", simulated.noise);
  simulated.X_CS = fields.pose("pose_error");
}

std::string pair_text(const char* key, double a, double b) {
  return fmt::format("  {}: [{:.10g}, {:.10g}]\n", key, a, b);
}

std::string lens_text(const camera::Lens& lens) {
  return "lens:\n" + pair_text("size_px", lens.width_px, lens.height_px) +
         pair_text("focal_px", lens.fx_px, lens.fy_px) + pair_text("centre_px", lens.cx_px, lens.cy_px) +
         fmt::format("  distortion: [{:.10g}, {:.10g}, {:.10g}, {:.10g}, {:.10g}]\n", lens.k1, lens.k2,
                     lens.p1, lens.p2, lens.k3);
}

std::string pose_text(const geometry::Pose& X_WC) {
  const Eigen::Matrix3d& R = X_WC.rotation;
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  // Looking along x or against it, roll and yaw turn about the same axis.
  const bool locked = std::hypot(R(0, 0), R(1, 0)) < 1e-9;
  const double yaw = locked ? 0.0 : std::atan2(R(1, 0), R(0, 0));
  const double roll =
      locked ? std::atan2(std::copysign(1.0, pitch) * R(0, 1), R(1, 1)) : std::atan2(R(2, 1), R(2, 2));
  const Eigen::Vector3d& t = X_WC.translation_m;
  return fmt::format("pose: {{xyz_m: [{:.9g}, {:.9g}, {:.9g}], rpy_deg: [{:.9g}, {:.9g}, {:.9g}]}}\n", t.x(),
                     t.y(), t.z(), roll / core::kRadPerDegree, pitch / core::kRadPerDegree,
                     yaw / core::kRadPerDegree);
}

}  // namespace

Calibration load_calibration(const std::filesystem::path& path) {
  const Fields file = Fields(path, camera_table()).as("calibration");
  Calibration found;
  std::string unused;
  file.text("made_utc", unused);
  if (file.has("lens")) found.lens = read_lens(file.section("lens"));
  if (file.has("pose")) found.X_WC = file.pose("pose");
  file.check(found.lens || found.X_WC, "lens", "is missing, and pose, too: at least one must be there");
  found.has_figures = file.has("lens_residual_px") || file.has("pose_residual_px");
  file.number("lens_residual_px", found.lens_residual_px);
  file.number("pose_residual_px", found.pose_residual_px);
  file.number("pose_residual_mm", found.pose_residual_mm);
  file.number("pose_sigma_mm", found.pose_sigma_mm);
  file.number("pose_sigma_deg", found.pose_sigma_deg);
  file.finish();
  return found;
}

VideoCamera load_video_camera(const std::filesystem::path& path) {
  const Fields file = Fields(path, camera_table()).as("camera");
  VideoCamera video;
  file.text("name", video.name);
  file.choice("source", video.kind,
              {{"device", VideoKind::kDevice},
               {"file", VideoKind::kFile},
               {"pictures", VideoKind::kPictures},
               {"topic", VideoKind::kTopic},
               {"simulated", VideoKind::kSimulated}});
  video.path = file.path("path");
  const bool by_path = video.kind != VideoKind::kSimulated && video.kind != VideoKind::kTopic;
  file.check(!by_path || !video.path.empty(), "path",
             "is missing: of the device, such as /dev/video0, the video or the folder of pictures");
  file.number("rate_hz", video.rate_hz);
  if (file.has("latency_ms")) video.latency_s = file.value("latency_ms") * 1e-3;
  video.calibration_file = path.parent_path() / (path.stem().string() + "_calibration.yaml");
  video.names_calibration = file.has("calibration");
  if (video.names_calibration) {
    video.calibration_file = file.existing_file("calibration");
    video.calibration = load_calibration(video.calibration_file);
  }
  if (file.has("lens")) {
    const camera::Lens lens = read_lens(file.section("lens"));
    if (!video.calibration.lens) video.calibration.lens = lens;
  }
  const bool from_eye = file.has("eye_m") || file.has("look_at_m");
  file.check(!from_eye || !file.has("pose"), "eye_m", "stands beside pose; allowed: one of the two");
  const Eigen::Vector3d eye_m = file.vector3("eye_m"), look_at_m = file.vector3("look_at_m");
  file.check(!from_eye || (eye_m - look_at_m).norm() > 1e-3, "look_at_m",
             "must not be the place of eye_m itself");
  std::optional<geometry::Pose> X_WC;
  if (file.has("pose")) X_WC = file.pose("pose");
  if (from_eye) X_WC = looking_at(eye_m, look_at_m);
  if (!video.calibration.X_WC) video.calibration.X_WC = X_WC;
  read_simulated(file.section("simulated"), video.simulated);
  // It stands where it did, however it is calibrated.
  if (X_WC) video.simulated.X_CS = video.calibration.X_WC->inverse() * *X_WC * video.simulated.X_CS;
  file.check(video.kind != VideoKind::kSimulated || video.calibrated(), "lens",
             "and pose are needed by a simulated camera");
  file.finish();
  return video;
}

void write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  std::string text = "# Written by synthetic_viewer calibrate.\n";
  text += fmt::format("made_utc: \"{:%Y-%m-%dT%H:%M:%SZ}\"\n", fmt::gmtime(std::time(nullptr)));
  if (calibration.lens) text += lens_text(*calibration.lens);
  if (calibration.X_WC) text += pose_text(*calibration.X_WC);
  if (calibration.lens_residual_px > 0.0)
    text += fmt::format("lens_residual_px: {:.4g}\n", calibration.lens_residual_px);
  if (calibration.pose_residual_px > 0.0)
    text += fmt::format(
        "pose_residual_px: {:.4g}\npose_residual_mm: {:.4g}\npose_sigma_mm: {:.4g}\npose_sigma_deg: {:.4g}\n",
        calibration.pose_residual_px, calibration.pose_residual_mm, calibration.pose_sigma_mm,
        calibration.pose_sigma_deg);
  const std::filesystem::path fresh = path.string() + ".new";
  std::ofstream file(fresh, std::ios::binary);
  file << text;
  file.close();
  if (!file || std::rename(fresh.c_str(), path.c_str()) != 0) {
    std::remove(fresh.c_str());
    throw core::MissingError(path.string() + ": cannot be written");
  }
}

}  // namespace phantom::synthetic_viewer
