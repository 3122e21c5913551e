#include "components/workspace_survey/part_picture.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "common/pictures/png.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr int kFiner = 2;  // drawn so many times as large, then made smaller, which smooths it
constexpr int kSide = 320, kCaption = 40;
constexpr float kNothing = std::numeric_limits<float>::max();

/// Draws a part from one side, without perspective, into a square.
class PartView {
 public:
  /// `towards`: from the part to who looks.
  PartView(const survey::PartModel& part, const Eigen::Vector3d& towards)
      : part_(part),
        image_(kFiner * kSide, kFiner * kSide, CV_8UC3, cv::Scalar(252, 251, 250)),
        depth_(image_.size(), CV_32F, cv::Scalar(kNothing)) {
    const Eigen::Vector3d away = -towards.normalized();
    axes_.row(0) = away.cross(Eigen::Vector3d::UnitZ()).normalized();
    axes_.row(1) = away.cross(Eigen::Vector3d(axes_.row(0)));
    axes_.row(2) = away;
    const auto box = part.mesh_O.bounding_box();
    middle_m_ = 0.5 * (box.min_m + box.max_m).cast<double>();
    pixels_per_m_ = 0.92 * kFiner * kSide / std::max(1e-9, part.extent_m);
  }

  cv::Mat drawn() {
    for (const auto& corners : part_.mesh_O.triangles)
      fill({at(vertex(corners[0])), at(vertex(corners[1])), at(vertex(corners[2]))});
    for (const auto& [from, to] : survey::sharp_edges(part_))
      edge(at(part_.nodes_O_m[from]), at(part_.nodes_O_m[to]));
    cv::Mat smooth;
    cv::resize(image_, smooth, {kSide, kSide}, 0, 0, cv::INTER_AREA);
    return smooth;
  }

 private:
  Eigen::Vector3d vertex(std::uint32_t i) const { return part_.mesh_O.vertices_m[i].cast<double>(); }
  /// Returns the pixel of a point, and how far away it is, in pixels, too.
  Eigen::Vector3d at(const Eigen::Vector3d& p_O_m) const {
    const double middle = 0.5 * kFiner * kSide;
    return pixels_per_m_ * (axes_ * (p_O_m - middle_m_)) + Eigen::Vector3d(middle, middle, 0.0);
  }

  void fill(const std::array<Eigen::Vector3d, 3>& p) {
    const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (!(std::abs(normal.z()) > 1e-9)) return;  // seen edge-on
    const double light = (std::abs(normal.z()) - 0.35 * normal.y() - 0.15 * normal.x()) / normal.norm();
    const auto grey = cv::saturate_cast<std::uint8_t>(80 + 120 * std::clamp(light, 0.0, 1.0));
    const cv::Vec3b colour(cv::saturate_cast<std::uint8_t>(grey + 25), grey,
                           cv::saturate_cast<std::uint8_t>(grey - 20));
    const auto [left, right] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    for (int y = std::max(0, static_cast<int>(top)); y <= std::min<int>(image_.rows - 1, int(bottom)); ++y) {
      for (int x = std::max(0, static_cast<int>(left)); x <= std::min<int>(image_.cols - 1, int(right)); ++x)
        put(p, normal, x, y, colour);
    }
  }

  /// Colours a pixel if the triangle covers it and is nearer than what was drawn there.
  void put(const std::array<Eigen::Vector3d, 3>& p, const Eigen::Vector3d& normal, int x, int y,
           const cv::Vec3b& colour) {
    const double u = x + 0.5, v = y + 0.5;
    double depth = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
      const double share = ((b.x() - a.x()) * (v - a.y()) - (b.y() - a.y()) * (u - a.x())) / normal.z();
      if (share < 0.0) return;
      depth += share * p[i].z();
    }
    if (depth >= depth_.at<float>(y, x)) return;
    depth_.at<float>(y, x) = static_cast<float>(depth);
    image_.at<cv::Vec3b>(y, x) = colour;
  }

  /// Draws an edge where nothing lies before it.
  void edge(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    constexpr double kBehind_px = 3.0 * kFiner;
    const double length = std::max(1.0, (to - from).head<2>().norm());
    for (double s = 0.0; s <= length; s += 0.5) {
      const Eigen::Vector3d p = from + s / length * (to - from);
      const cv::Rect dot = cv::Rect(static_cast<int>(p.x()) - kFiner / 2,
                                    static_cast<int>(p.y()) - kFiner / 2, kFiner, kFiner) &
                           cv::Rect(0, 0, image_.cols, image_.rows);
      if (dot.empty() || p.z() > depth_.at<float>(dot.y, dot.x) + kBehind_px) continue;
      image_(dot) = cv::Scalar(70, 50, 35);
    }
  }

  const survey::PartModel& part_;
  cv::Mat image_, depth_;
  Eigen::Matrix3d axes_;  // rows: right, down and away
  Eigen::Vector3d middle_m_;
  double pixels_per_m_ = 1.0;
};

}  // namespace

std::string size_text(const survey::PartModel& part) {
  const auto box = part.mesh_O.bounding_box();
  const Eigen::Vector3d size_mm = 1e3 * (box.max_m - box.min_m).cast<double>();
  return fmt::format("{:.4g} x {:.4g} x {:.4g} mm", size_mm.x(), size_mm.y(), size_mm.z());
}

std::vector<std::uint8_t> part_picture(const survey::PartModel& part) {
  cv::Mat picture(kSide + kCaption, 2 * kSide, CV_8UC3, cv::Scalar::all(255));
  PartView(part, {1.0, -1.6, 1.1}).drawn().copyTo(picture(cv::Rect(0, 0, kSide, kSide)));
  PartView(part, {-1.6, 1.0, -1.1}).drawn().copyTo(picture(cv::Rect(kSide, 0, kSide, kSide)));
  cv::putText(picture, size_text(part), {14, kSide + 27}, cv::FONT_HERSHEY_SIMPLEX, 0.75,
              cv::Scalar(40, 40, 40), 1, cv::LINE_AA);
  return pictures::encode_png(picture.data, picture.cols, picture.rows, picture.step[0]);
}

}  // namespace phantom::workspace_survey
