#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/fusion/depth_image.hpp"
#include "components/workspace_camera/pose_check.hpp"

namespace phantom::workspace_camera {

/// By how much a camera stands elsewhere than its pose says: X_WC · exp(offset) is where the image fits the
/// model best.
struct CameraOffset {
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< C axes
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();   ///< C axes
  /// Information of (turn, shift), turns in units of 1 ÷ `distance_m`; 1/m².
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  double distance_m = 1.0;  ///< mean distance of what was compared
  std::size_t pixels = 0;   ///< that were compared
};

/// Compares the images of a camera that is fixed in the cell with the model as it stands, to find that the
/// camera was knocked. Every second pixel, that of neither the arm nor anything farther than kGate_m from the
/// model, is brought onto the surface of those of its objects that are there: point to plane, association by
/// projection, weights of Tukey's kind (Chen and Medioni 1992; KinectFusion, Newcombe et al. 2011). Pure. Not
/// real-time safe.
class CameraAlignment {
 public:
  explicit CameraAlignment(const fusion::DepthSigma& sigma) : sigma_(sigma) {}

  /// Draws the model as the camera sees it. `X_WO`: of each object.
  void set_model(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
                 std::span<const ModelObject> objects, std::span<const Place> X_WO);
  /// Returns whether the model was drawn for this camera and pose.
  bool is_for(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC) const;
  /// Returns nothing if fewer than kMinPixels can be compared. `arm_depth_m`: as ArmView draws it; empty:
  /// there is no arm.
  std::optional<CameraOffset> offset(const fusion::DepthImage& image,
                                     std::span<const float> arm_depth_m) const;

  /// What of the model a camera should see, in every second pixel, that of the arm left out.
  struct View {
    std::size_t expected = 0;  ///< pixels in which the model has a surface that the camera can measure
    std::size_t hidden = 0;    ///< of which nothing was measured, or something before it
  };
  /// If the model has less than kMinPixels in view, or was not drawn, the camera should see something
  /// everywhere.
  View view(const fusion::DepthImage& image, std::span<const float> arm_depth_m) const;
  /// The same of a camera that moves: the model is drawn where this image was taken, in coarse pixels.
  static View view_of_model(const fusion::DepthImage& image, std::span<const float> arm_depth_m,
                            std::span<const ModelObject> objects, std::span<const Place> X_WO);

  static constexpr double kGate_m = 0.05;
  static constexpr std::size_t kMinPixels = 500;

 private:
  struct Surface {
    Eigen::Vector3f point_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();  // C; 0: none
    std::uint16_t object = 0;  // its place among the model's
  };

  std::vector<char> present(const fusion::DepthImage& image) const;

  fusion::DepthSigma sigma_;
  std::size_t objects_ = 0;
  fusion::PinholeCamera camera_;
  geometry::Pose X_WC_;
  std::vector<Surface> surface_;  // by pixel
};

/// Monitors whether a camera is covered: whether it sees hardly anything of what it should. One camera.
class CoverWatch {
 public:
  static constexpr double kCovered = 0.95, kOpen = 0.85;  ///< shares of what is hidden
  static constexpr int kConfirmations = 2;                ///< successive images

  /// Takes what an image shows; one with less than CameraAlignment::kMinPixels says nothing.
  void put(const CameraAlignment::View& view);
  bool covered() const { return covered_; }

 private:
  int against_ = 0;  // successive images that say otherwise
  bool covered_ = false;
};

/// Monitors the extrinsic calibration of a camera: it was knocked if its offset differs from that of its
/// first images, in the directions that an image determines. Those first images are a test of its mounting:
/// the cell is the known target. One camera.
class KnockWatch {
 public:
  /// The least shift, at the distance of what is seen, and the least turn that are reported.
  static constexpr double kShift_m = 0.007, kTurn_rad = 0.006;
  /// Of the first images: less is an error of the model.
  static constexpr double kMountingShift_m = 0.015, kMountingTurn_rad = 0.0175;
  static constexpr int kFirst = 8;          ///< images that the camera is compared with
  static constexpr int kConfirmations = 2;  ///< successive offsets of which each is that great

  /// Takes the offset of an image.
  void put(const CameraOffset& offset);
  /// The model has changed: the next images are the first ones again. They are a test of the mounting only if
  /// the one before found it wrong: that may have been the model.
  void restart();
  bool knocked() const { return knocked_; }
  /// The first images do not fit the configured pose.
  bool misplaced() const { return misplaced_; }
  double shift_m() const { return shift_m_; }  ///< of the newest image; of all the first ones, if misplaced
  double turn_rad() const { return turn_rad_; }

 private:
  void judge(const CameraOffset& offset, const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_m);

  Eigen::Vector3d first_turn_rad_ = Eigen::Vector3d::Zero(), first_shift_m_ = Eigen::Vector3d::Zero();
  int taken_ = 0, beyond_ = 0, within_ = 0;
  bool knocked_ = false, misplaced_ = false, mounting_tested_ = false;
  double shift_m_ = 0.0, turn_rad_ = 0.0;
};

}  // namespace phantom::workspace_camera
