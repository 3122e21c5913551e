#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/fusion/depth_image.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/survey/touch.hpp"
#include "common/survey/touch_surface.hpp"
#include "components/workspace_camera/pose_refinement.hpp"

namespace phantom::workspace_camera {

struct PoseCheckRules {
  double every_s = 2.0;        ///< 0: poses are not checked
  double tolerance_m = 0.015;  ///< a pixel agrees with the model within this and 4 σ of its depth
  double reach_m = 0.15;       ///< an object is looked for so far from where the model has it
  fusion::DepthSigma sigma;
};

/// An object of the model, of which the pose is checked.
struct ModelObject {
  std::uint16_t id = 0;
  std::string name;
  geometry::TriangleMesh mesh_O;
};

/// What is seen so near before the arm, or behind it, is taken for the arm.
inline constexpr double kArmMargin_m = 0.05;

/// Where an object stands; nothing: it is not in the workspace.
using Place = std::optional<geometry::Pose>;
/// Returns whether two places are the same to the last bit.
bool is_same(const Place& a, const Place& b);

enum class PoseVerdict : std::uint8_t {
  kUnseen,     ///< too few of its pixels are in view
  kAgrees,     ///< it stands where the model has it, as far as this image shows
  kElsewhere,  ///< it stands where `corrected_WO` says
  kGone,       ///< the camera sees through where the model has it, and it is not within reach
  kUnclear     ///< it is not where the model has it; the image does not show where it is
};

/// What an image shows of an object's pose.
struct PoseFinding {
  std::uint16_t id = 0;
  std::string name;
  PoseVerdict verdict = PoseVerdict::kUnseen;
  geometry::Pose X_WO;                                ///< where the model has it
  geometry::Pose corrected_WO;                        ///< kElsewhere; else X_WO
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< of the middle of its box, W axes
  double turned_rad = 0.0;
  double residual_m = 0.0;        ///< rms of the seen points from the corrected surface
  std::vector<std::string> open;  ///< directions that the image does not determine: taken from the model
  std::size_t pixels = 0, agree = 0, through = 0;  ///< of its pixels: judged, at their depth, seen through
};

/// Checks the pose of each object of the model against a depth image.
///
/// The model is drawn as the camera sees it. A pixel inside of an object's silhouette agrees, is seen through
/// (measured behind the surface: nothing is there) or hidden (measured in front of it). Where many of an
/// object's pixels are hidden, or some are seen through, the points that the camera measured around it are
/// fitted to its surface (survey::correct_by_touch, which leaves open what they do not determine), and it is
/// tried as if it were slid over its place; the best of these poses is refined (PoseRefinement). The
/// correction counts only if the object, drawn there, agrees with the image, and clearly better than where
/// the model has it. Pixels of other objects that agree, and those at or behind the arm, say nothing. A fit
/// takes about a second: kMaxFits of them are made for an image; what one found is kept while the images
/// confirm it, and one that failed is tried again after kRest images. Equal sequences of inputs give equal
/// findings. Not real-time safe.
class PoseCheck {
 public:
  /// Objects without triangles are left out.
  PoseCheck(const PoseCheckRules& rules, std::vector<ModelObject> objects);

  const std::vector<ModelObject>& objects() const { return objects_; }

  /// `arm_depth_m`: of each pixel, as ArmView draws it, 0: none; empty: there is no arm. `X_WO`: of each
  /// object. Returns a finding for each object that is.
  std::vector<PoseFinding> judge(const fusion::DepthImage& image, std::span<const float> arm_depth_m,
                                 std::span<const Place> X_WO);

  static constexpr int kMaxFits = 2, kRest = 5;
  static constexpr std::size_t kMinPixels = 60;

 private:
  /// What the model has at a pixel.
  struct Drawn {
    float depth_m = 0.0F;  // 0: nothing
    int object = -1;
  };
  struct Count {
    std::size_t agree = 0, through = 0, hidden = 0;
    std::size_t judged() const { return agree + through + hidden; }
  };

  void draw(std::size_t object, const geometry::Pose& X_WO, std::vector<Drawn>& into);
  bool is_inside(const std::vector<Drawn>& drawn, std::size_t pixel) const;
  bool is_of_arm(std::size_t pixel) const;
  static bool seems_moved(const Count& seen);
  double tolerance_m(double depth_m) const;
  void count(const std::vector<Drawn>& drawn, std::vector<Count>& counts) const;
  /// What is known of an object that does not stand where the model has it.
  struct Known {
    geometry::Pose X_WO;  // of the model, then
    PoseFinding finding;
    int rest = 0;  // images until the next fit
  };
  void find(std::size_t object, const geometry::Pose& X_WO, const Count& seen, int& fits,
            PoseFinding& finding);
  /// What is fitted to an object's surface.
  struct Measured {
    std::vector<survey::Touch> near;
    std::vector<survey::FreePlace> free;
  };
  Measured measured_around(std::size_t object, const geometry::Pose& X_WO) const;
  bool fit(std::size_t object, const geometry::Pose& X_WO, PoseFinding& finding);
  Count count_at(std::size_t object, const geometry::Pose& X_WO);
  static bool stands_there(const Count& there);
  PoseRefinement::Evidence evidence_of(std::size_t object);
  geometry::Pose slid(PoseRefinement& refinement, const geometry::Pose& X_WO) const;

  PoseCheckRules rules_;
  std::vector<ModelObject> objects_;
  std::vector<survey::TouchSurface> surfaces_;
  std::vector<std::optional<Known>> known_;    // by object
  std::size_t first_ = 0;                      // object whose fit comes first
  const fusion::DepthImage* image_ = nullptr;  // during judge()
  std::span<const float> arm_depth_m_;
  std::span<const Place> places_;
  std::vector<Drawn> drawn_, moved_;
  std::vector<Eigen::Vector3d> corners_m_;
};

}  // namespace phantom::workspace_camera
