#include "components/workspace_survey/picture.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/pictures/png.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr int kWidth = 1240, kTop = 70, kView = 620, kMargin = 46, kRow = 34, kBars = 720, kBarsWidth = 400;
constexpr double kMagnified = 20.0;
const cv::Scalar kInk(40, 40, 40), kPaper(255, 255, 255), kLine(205, 205, 205), kModel(150, 110, 60),
    kMeasured(40, 40, 200), kAcross(60, 150, 60);

/// The head's view of the object: right, down and away from the head are unit vectors in W.
struct View {
  Eigen::Vector3d right, down, away, centre_m;
  double pixels_per_m = 1.0;

  cv::Point2d at(const Eigen::Vector3d& p_W_m) const {
    const Eigen::Vector3d from = p_W_m - centre_m;
    return {kMargin + 0.5 * kView + pixels_per_m * right.dot(from),
            kTop + 0.5 * kView + pixels_per_m * down.dot(from)};
  }
};

class Drawing {
 public:
  explicit Drawing(const SurveyReport& report)
      : report_(report),
        object_(*report.result.object),
        part_(report.library.models[object_.part]),
        image_(
            std::max(kTop + kView + 60, kTop + 60 + kRow * static_cast<int>(object_.fit.nodes.size()) + 60),
            kWidth, CV_8UC3, kPaper) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const Eigen::Vector3d& p : part_.extremes_O_m) {
      low = low.cwiseMin(object_.fit.X_WO * p);
      high = high.cwiseMax(object_.fit.X_WO * p);
    }
    view_.centre_m = 0.5 * (low + high);
    view_.away = (view_.centre_m - report.measurement.eye_W_m).normalized();
    view_.right = view_.away.cross(Eigen::Vector3d::UnitZ());
    view_.right = view_.right.norm() > 1e-6 ? view_.right.normalized().eval() : view_.away.unitOrthogonal();
    view_.down = view_.away.cross(view_.right);
    double reach_m = 1e-3;
    for (const Eigen::Vector3d& p : part_.extremes_O_m) {
      const Eigen::Vector3d from = object_.fit.X_WO * p - view_.centre_m;
      reach_m = std::max({reach_m, std::abs(view_.right.dot(from)), std::abs(view_.down.dot(from))});
    }
    view_.pixels_per_m = 0.34 * kView / reach_m;
  }

  std::vector<std::uint8_t> png() {
    write(fmt::format("{}: fitted pose against {} measured nodes", report_.library.parts[object_.part].name,
                      object_.fit.nodes.size()),
          {kMargin, 28}, 0.62);
    write(fmt::format("probability {:.2g}, worst point within {:.1f} mm ({:.0f} %), guard {} x {:.3g} mm",
                      object_.fit.probability(), 1e3 * object_.worst_displacement_m,
                      100 * report_.config.options.confidence, guard_of(report_),
                      1e3 * report_.voxel_size_m.reference_m()),
          {kMargin, 52}, 0.46);
    cv::rectangle(image_, {kMargin, kTop, kView, kView}, kLine);
    model();
    nodes();
    scale_bar();
    bars();
    return pictures::encode_png(image_.data, image_.cols, image_.rows, image_.step[0]);
  }

 private:
  void write(const std::string& words, cv::Point at, double size = 0.42, const cv::Scalar& ink = kInk) {
    cv::putText(image_, words, at, cv::FONT_HERSHEY_SIMPLEX, size, ink, 1, cv::LINE_AA);
  }
  void line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const cv::Scalar& colour, int thickness) {
    cv::line(image_, view_.at(a), view_.at(b), colour, thickness, cv::LINE_AA);
  }

  /// Draws the borders of faces: strong if the face is turned to the head, otherwise pale.
  void model() {
    const auto sharp = survey::sharp_edges(part_);
    const Eigen::Vector3d eye_O = object_.fit.X_WO.inverse() * report_.measurement.eye_W_m;
    for (const bool facing : {false, true}) {
      for (const survey::BorderLoop& loop : part_.loops) {
        const bool faces =
            part_.faces[loop.face].normal_O.dot(eye_O - part_.nodes_O_m[loop.nodes.front()]) > 0;
        if (faces != facing) continue;
        for (std::size_t i = 0; i < loop.nodes.size(); ++i) {
          if (!sharp.contains(std::minmax({loop.nodes[i], loop.nodes[(i + 1) % loop.nodes.size()]})))
            continue;
          line(object_.fit.X_WO * part_.nodes_O_m[loop.nodes[i]],
               object_.fit.X_WO * part_.nodes_O_m[loop.nodes[(i + 1) % loop.nodes.size()]],
               facing ? kModel : kLine, facing ? 2 : 1);
        }
      }
    }
  }

  /// Draws each node at its place on the model, with its 2σ ellipse and its residual, both magnified equally.
  void nodes() {
    for (std::size_t i = 0; i < object_.fit.nodes.size(); ++i) {
      const survey::MeasuredNode& node = report_.measurement.nodes[object_.fit.nodes[i]];
      const Eigen::Vector3d model = node.p_W_m - object_.fit.residual_W_m[i];
      std::vector<cv::Point> ellipse;
      const Eigen::Matrix3d& C = node.covariance_m2;
      const double a = view_.right.dot(C * view_.right), b = view_.down.dot(C * view_.down),
                   c = view_.right.dot(C * view_.down);
      const double l = std::sqrt(a), m = c / l, n = std::sqrt(std::max(b - m * m, 0.0));  // Cholesky factor
      for (int k = 0; k < 40; ++k) {
        const double x = 2 * l * std::cos(k * CV_PI / 20),
                     y = 2 * (m * std::cos(k * CV_PI / 20) + n * std::sin(k * CV_PI / 20));
        ellipse.push_back(view_.at(model + kMagnified * (x * view_.right + y * view_.down)));
      }
      cv::polylines(image_, ellipse, true, kAcross, 1, cv::LINE_AA);
      const auto from = view_.at(model), to = view_.at(model + kMagnified * object_.fit.residual_W_m[i]);
      cv::line(image_, from, to, kMeasured, 2, cv::LINE_AA);
      cv::circle(image_, to, 4, kMeasured, cv::FILLED, cv::LINE_AA);
      write(node.name, {static_cast<int>(from.x) + 9, static_cast<int>(from.y) - 9}, 0.5);
    }
  }

  void scale_bar() {
    double step_m = 1.0;
    while (step_m * view_.pixels_per_m > 0.3 * kView) step_m /= step_m > 0.3 ? 2.0 : 10.0;
    while (step_m * view_.pixels_per_m < 0.08 * kView) step_m *= 2.0;
    const int y = kTop + kView + 22;
    cv::rectangle(image_, {kMargin, y, static_cast<int>(step_m * view_.pixels_per_m), 5}, kInk, cv::FILLED);
    write(fmt::format(
              "{:.4g} mm; seen from the head. Residuals and 2 sigma of each node drawn {:.0f} times as large",
              1e3 * step_m, kMagnified),
          {kMargin + static_cast<int>(step_m * view_.pixels_per_m) + 10, y + 7});
  }

  /// Draws each node's residual along and across the beam, with 2σ of the range.
  void bars() {
    const auto& fit = object_.fit;
    double most_m = 1e-4;
    for (std::size_t i = 0; i < fit.nodes.size(); ++i) {
      const survey::MeasuredNode& node = report_.measurement.nodes[fit.nodes[i]];
      most_m = std::max({most_m, fit.residual_W_m[i].norm(),
                         2 * std::sqrt(node.beam_W.dot(node.covariance_m2 * node.beam_W))});
    }
    const double pixels_per_m = 0.5 * kBarsWidth / most_m;
    const int zero = kBars + kBarsWidth / 2;
    write("residual along the beam (red: too long to the right), across it (green)", {kBars - 30, kTop + 14});
    int y = kTop + 40;
    for (std::size_t i = 0; i < fit.nodes.size(); ++i, y += kRow) {
      const survey::MeasuredNode& node = report_.measurement.nodes[fit.nodes[i]];
      const double along = fit.residual_W_m[i].dot(node.beam_W),
                   across = (fit.residual_W_m[i] - along * node.beam_W).norm();
      const int two_sigma =
          static_cast<int>(2 * std::sqrt(node.beam_W.dot(node.covariance_m2 * node.beam_W)) * pixels_per_m);
      cv::rectangle(image_, cv::Point(zero - two_sigma, y - 11), cv::Point(zero + two_sigma, y + 11),
                    cv::Scalar(235, 235, 235), cv::FILLED);
      bar(zero, y - 9, along * pixels_per_m, kMeasured);
      bar(zero, y + 1, across * pixels_per_m, kAcross);
      write(node.name, {kBars - 30, y + 4}, 0.5);
      write(fmt::format("{:+.1f} / {:.1f}", 1e3 * along, 1e3 * across), {kBars + kBarsWidth + 10, y + 4},
            0.38);
    }
    cv::line(image_, {zero, kTop + 26}, {zero, y - 14}, kInk);
    write(fmt::format("grey: two standard deviations of the range; full width {:.1f} mm", 2e3 * most_m),
          {kBars - 30, y + 8});
  }
  void bar(int zero, int y, double length, const cv::Scalar& colour) {
    const int end = zero + static_cast<int>(std::lround(length));
    cv::rectangle(image_, cv::Point(std::min(zero, end), y), cv::Point(std::max(zero, end), y + 7), colour,
                  cv::FILLED);
  }

  const SurveyReport& report_;
  const survey::FittedObject& object_;
  const survey::PartModel& part_;
  View view_;
  cv::Mat image_;
};

}  // namespace

std::vector<std::uint8_t> residual_picture(const SurveyReport& report) { return Drawing(report).png(); }

}  // namespace phantom::workspace_survey
