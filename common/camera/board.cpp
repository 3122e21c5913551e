#include "common/camera/board.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "common/core/text.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::camera {
namespace {

constexpr double kUnsureFocalLength = 0.02;
constexpr double kReachForAllTerms = 0.85;
constexpr double kMinTilt_rad = 0.17;  // between two of the boards

/// Returns the mean grey around the middle of the square beyond an end corner: opposite to `next` and
/// `below`.
double grey_beyond(const cv::Mat& grey, const cv::Point2f& end, const cv::Point2f& next,
                   const cv::Point2f& below) {
  const cv::Point2f middle = end - 0.5F * (next - end) - 0.5F * (below - end);
  const float step = 0.1F * static_cast<float>(cv::norm(next - end));
  double sum = 0.0;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j) {
      const int x = std::clamp(cvRound(middle.x + step * static_cast<float>(i)), 0, grey.cols - 1);
      const int y = std::clamp(cvRound(middle.y + step * static_cast<float>(j)), 0, grey.rows - 1);
      sum += grey.at<std::uint8_t>(y, x) / 9.0;
    }
  return sum;
}

/// Returns how far from the picture's middle corners were seen, half its diagonal being 1.
double reach_of(int width_px, int height_px, std::span<const std::vector<Eigen::Vector2d>> pictures) {
  const Eigen::Vector2d middle((width_px - 1) / 2.0, (height_px - 1) / 2.0);
  double farthest_px = 0.0;
  for (const auto& corners : pictures)
    for (const Eigen::Vector2d& corner : corners)
      farthest_px = std::max(farthest_px, (corner - middle).norm());
  return farthest_px / middle.norm();
}

/// Returns the greatest angle between two of the boards.
double tilt_rad(const std::vector<geometry::Pose>& boards) {
  double greatest = 0.0;
  for (const geometry::Pose& a : boards)
    for (const geometry::Pose& b : boards)
      greatest =
          std::max(greatest, std::acos(std::clamp(a.rotation.col(2).dot(b.rotation.col(2)), -1.0, 1.0)));
  return greatest;
}

geometry::Pose pose_of(const cv::Mat& turn, const cv::Mat& shift) {
  return {geometry::rotation_from_vector({turn.at<double>(0), turn.at<double>(1), turn.at<double>(2)}),
          {shift.at<double>(0), shift.at<double>(1), shift.at<double>(2)}};
}

}  // namespace

std::optional<std::vector<Eigen::Vector2d>> find_corners(const GreyPicture& picture, const Board& board) {
  if (picture.octets == nullptr || picture.width_px < 16 || picture.height_px < 16 || board.columns < 3 ||
      board.rows < 3)
    return std::nullopt;
  // OpenCV does not write to its input.
  const cv::Mat grey(picture.height_px, picture.width_px, CV_8UC1, const_cast<std::uint8_t*>(picture.octets));
  std::vector<cv::Point2f> corners;
  const int how = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY | cv::CALIB_CB_EXHAUSTIVE;
  if (!cv::findChessboardCornersSB(grey, {board.columns, board.rows}, corners, how)) return std::nullopt;
  if (static_cast<int>(corners.size()) != board.corners()) return std::nullopt;
  const auto at = [&](int number) { return corners[static_cast<std::size_t>(number)]; };
  const int last = board.corners() - 1;
  const double first_grey = grey_beyond(grey, at(0), at(1), at(board.columns));
  const double last_grey = grey_beyond(grey, at(last), at(last - 1), at(last - board.columns));
  if (board.has_first_corner() && first_grey > last_grey) std::ranges::reverse(corners);
  std::vector<Eigen::Vector2d> found;
  for (const cv::Point2f& corner : corners) found.emplace_back(corner.x, corner.y);
  return found;
}

core::Expected<LensFit> fit_lens(int width_px, int height_px, const Board& board,
                                 std::span<const std::vector<Eigen::Vector2d>> pictures,
                                 double largest_rms_px) {
  if (pictures.size() < 3)
    return core::Status::invalid_argument(
        core::formatted("a lens needs three pictures of the board or more, there are %zu", pictures.size()));
  std::vector<std::vector<cv::Point3f>> places;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const auto& corners : pictures) {
    if (static_cast<int>(corners.size()) != board.corners())
      return core::Status::invalid_argument(core::formatted(
          "a picture has %zu corners; allowed: %d, the board's", corners.size(), board.corners()));
    auto& place = places.emplace_back();
    auto& pixels = seen.emplace_back();
    for (int i = 0; i < board.corners(); ++i) {
      const Eigen::Vector3f p = board.corner_B_m(i).cast<float>();
      place.emplace_back(p.x(), p.y(), p.z());
      const Eigen::Vector2f pixel = corners[static_cast<std::size_t>(i)].cast<float>();
      pixels.emplace_back(pixel.x(), pixel.y());
    }
  }
  cv::Mat matrix, distortion, deviations, unused, each;
  std::vector<cv::Mat> turns, shifts;
  LensFit fit;
  fit.reach = reach_of(width_px, height_px, pictures);
  // The last term of the distortion runs wild beyond the outermost corners.
  const int how = fit.reach < kReachForAllTerms ? cv::CALIB_FIX_K3 : 0;
  try {
    fit.rms_px = cv::calibrateCamera(places, seen, {width_px, height_px}, matrix, distortion, turns, shifts,
                                     deviations, unused, each, how);
  } catch (const cv::Exception& problem) {
    return core::Status::invalid_argument("the pictures do not determine a lens: " + problem.err);
  }
  const auto factor = [&](int i) { return distortion.at<double>(i); };
  fit.lens = {width_px,
              height_px,
              matrix.at<double>(0, 0),
              matrix.at<double>(1, 1),
              matrix.at<double>(0, 2),
              matrix.at<double>(1, 2),
              factor(0),
              factor(1),
              factor(2),
              factor(3),
              factor(4)};
  fit.focal_sigma_px = std::max(deviations.at<double>(0), deviations.at<double>(1));
  fit.centre_sigma_px = std::max(deviations.at<double>(2), deviations.at<double>(3));
  for (std::size_t i = 0; i < turns.size(); ++i) {
    fit.picture_rms_px.push_back(each.at<double>(static_cast<int>(i)));
    fit.X_CB.push_back(pose_of(turns[i], shifts[i]));
  }
  if (!(fit.rms_px <= largest_rms_px))
    return core::Status::invalid_argument(core::formatted(
        "the board does not fit: residual %.2f px; allowed: %.2f px. Is it flat, and its number of corners right?",
        fit.rms_px, largest_rms_px));
  if (!(tilt_rad(fit.X_CB) > kMinTilt_rad))
    return core::Status::invalid_argument(core::formatted(
        "no two pictures show the board tilted by more than %.0f degrees to each other: tilt the board by 20 to 45 "
        "degrees, in other ways in each picture",
        kMinTilt_rad * 180 / 3.14159));
  if (!(fit.focal_sigma_px < kUnsureFocalLength * std::min(fit.lens.fx_px, fit.lens.fy_px)))
    return core::Status::invalid_argument(core::formatted(
        "the focal length is unsure by %.1f px of %.0f px: tilt the board by 20 to 45 degrees, in other ways in "
        "each picture, and let it fill the picture",
        fit.focal_sigma_px, fit.lens.fx_px));
  if (const std::string fault = fault_of(fit.lens); !fault.empty())
    return core::Status::invalid_argument("the lens found makes no sense: " + fault);
  return fit;
}

}  // namespace phantom::camera
