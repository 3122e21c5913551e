#include "components/wva_server/slice_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/core/text.hpp"
#include "common/layers/activation.hpp"
#include "common/pictures/png.hpp"

namespace phantom::wva_server {
namespace {

using workspace::Index3;
using workspace::VoxelBox;
using workspace::Workspace;

constexpr int kMargin = 70, kGap = 80, kMax = 620, kLegend = 190, kTop = 64;
const cv::Scalar kInk(40, 40, 40), kPaper(255, 255, 255), kLine(170, 170, 170);

/// Interpolates between colours (blue, green, red: OpenCV's order of channels); `share` is 0…1.
cv::Vec3b between(const std::vector<cv::Vec3d>& stops, double share) {
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(stops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  const cv::Vec3d mixed = stops[i] + (stops[i + 1] - stops[i]) * (at - static_cast<double>(i));
  return {static_cast<std::uint8_t>(mixed[0]), static_cast<std::uint8_t>(mixed[1]),
          static_cast<std::uint8_t>(mixed[2])};
}

/// The colour of each order: layers from red (near) to pale blue (far), layers inside in browns, the guard
/// violet.
class Colours {
 public:
  Colours(int layers, int inside) : layers_(layers), inside_(inside) {}
  cv::Vec3b of(int order) const {
    if (order == workspace::kOrderFree) return {255, 255, 255};
    if (order == workspace::kOrderBoundary) return {30, 30, 30};
    if (order == workspace::kOrderInterior) return {130, 130, 130};
    if (order == workspace::kOrderGuard) return {180, 60, 140};
    const auto place = [](int i, int count) { return count > 1 ? (i - 1.0) / (count - 1.0) : 0.0; };
    if (order < 0) return between({{120, 190, 225}, {40, 90, 140}}, place(-order, inside_));
    return between({{38, 28, 200}, {60, 140, 250}, {130, 225, 255}, {170, 220, 150}, {235, 205, 150}},
                   place(order, layers_));
  }

 private:
  int layers_, inside_;
};

/// The orders that occur in the workspace, in the legend's sequence: from far outside to deep inside.
struct Present {
  std::vector<int> orders;
  int layers = 0, inside = 0;
};

Present look(const Workspace& workspace) {
  Present present;
  const auto counts = layers::count_orders(workspace);
  const auto add = [&](int order) {
    if (counts[static_cast<std::uint8_t>(order)] != 0) present.orders.push_back(order);
  };
  for (int order = workspace::kMaxLayers; order >= 1; --order) {
    if (counts[static_cast<std::uint8_t>(order)] != 0) present.layers = std::max(present.layers, order);
    add(order);
  }
  add(workspace::kOrderGuard);
  add(workspace::kOrderBoundary);
  for (int order = 1; order <= workspace::kMaxLayers; ++order) {
    if (counts[static_cast<std::uint8_t>(-order)] != 0) present.inside = order;
    add(-order);
  }
  add(workspace::kOrderInterior);
  return present;
}

std::string name_of(int order, const PictureText& text) {
  if (order == workspace::kOrderBoundary) return "boundary";
  if (order == workspace::kOrderInterior) return "interior";
  if (order == workspace::kOrderGuard) return "guard";
  if (order < 0) return "inside " + std::to_string(order);
  const auto i = static_cast<std::size_t>(order - 1);
  const std::string note = i < text.layer_notes.size() ? "  " + text.layer_notes[i] : "";
  return "layer " + std::to_string(order) + note;
}

/// Returns the middle of the solid voxels, or of the grid if there are none.
Index3 middle_of(const Workspace& workspace) {
  const auto& size = workspace.grid().size_vox;
  std::array<std::int32_t, 3> low{INT32_MAX, INT32_MAX, INT32_MAX}, high{-1, -1, -1};
  for (const workspace::BrickKey key : workspace.bricks()) {
    const VoxelBox box = workspace::box_of(key);
    const auto brick = workspace.brick(key);
    for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i) {
      const std::int32_t x = static_cast<std::int32_t>(i & 31), y = static_cast<std::int32_t>(i >> 5 & 31),
                         z = static_cast<std::int32_t>(i >> 10);
      const std::int8_t order = brick.order[workspace::brick_offset(i & 31, i >> 5 & 31, i >> 10)];
      if (order != workspace::kOrderBoundary && order != workspace::kOrderInterior) continue;
      const std::array<std::int32_t, 3> v{box.min.x + x, box.min.y + y, box.min.z + z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], v[axis]);
        high[axis] = std::max(high[axis], v[axis]);
      }
    }
  }
  if (high[0] < 0) return {size[0] / 2, size[1] / 2, size[2] / 2};
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
}

/// Returns 1, 2 or 5 times a power of ten, at most `most`.
double round_length(double most) {
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  return most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
}

class Drawing {
 public:
  Drawing(const Workspace& workspace, const PictureText& text)
      : workspace_(workspace),
        text_(text),
        present_(look(workspace)),
        colours_(present_.layers, present_.inside),
        middle_(middle_of(workspace)) {
    const workspace::GridSpec& grid = workspace.grid();
    const double extent_m = std::max(grid.extent_m().maxCoeff(), grid.voxel_size_m.greatest_m());
    pixels_per_m_ = kMax / extent_m;
    for (std::size_t axis = 0; axis < 3; ++axis)
      pixels_[axis] =
          std::max(1, static_cast<int>(std::lround(grid.size_vox[axis] * pixels_per_voxel(axis))));
    unit_ = extent_m < 2.0 ? 1e-3 : 1.0;
    step_m_ = round_length(extent_m / 4.0);
    const int rows = std::max(kTop + pixels_[1], kTop + legend_height()) + kGap + pixels_[2] + kMargin;
    image_ = cv::Mat(rows, kMargin + pixels_[0] + kGap + std::max(pixels_[1], kLegend) + 30, CV_8UC3, kPaper);
  }

  std::vector<std::uint8_t> png() {
    write(text_.title, {kMargin, 24}, 0.6);
    const cv::Point plan(kMargin, kTop), front(kMargin, image_.rows - kMargin - pixels_[2]),
        side(kMargin + pixels_[0] + kGap, front.y);
    panel(plan, 0, 1, 2);
    panel(front, 0, 2, 1);
    panel(side, 1, 2, 0);
    legend({side.x, kTop + 6});
    scale_bar({kMargin, image_.rows - 14});
    return pictures::encode_png(image_.data, image_.cols, image_.rows, image_.step[0]);
  }

 private:
  int legend_height() const { return 10 + 20 * static_cast<int>(present_.orders.size()); }

  void write(const std::string& words, cv::Point at, double size = 0.42, cv::Scalar ink = kInk) {
    cv::putText(image_, words, at, cv::FONT_HERSHEY_SIMPLEX, size, ink, 1, cv::LINE_AA);
  }
  std::string length_text(double metres) const {
    return core::formatted("%g", std::round(metres / unit_ * 1e6) / 1e6);
  }
  const char* unit_name() const { return unit_ < 1.0 ? "mm" : "m"; }

  double pixels_per_voxel(std::size_t axis) const {
    return pixels_per_m_ * workspace_.grid().voxel_size_m[axis];
  }
  std::int32_t index(Index3 v, std::size_t axis) const { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

  /// Draws a section at the middle of axis `c`, with axis `a` to the right and `b` up.
  void panel(cv::Point corner, std::size_t a, std::size_t b, std::size_t c) {
    const int width = pixels_[a], height = pixels_[b];
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        std::array<std::int32_t, 3> v{middle_.x, middle_.y, middle_.z};
        v[a] = static_cast<std::int32_t>((column + 0.5) / pixels_per_voxel(a));
        v[b] = static_cast<std::int32_t>((height - 1 - row + 0.5) / pixels_per_voxel(b));
        image_.at<cv::Vec3b>(corner.y + row, corner.x + column) =
            colours_.of(workspace_.order({v[0], v[1], v[2]}));
      }
    }
    cv::rectangle(image_, {corner.x - 1, corner.y - 1, width + 2, height + 2}, kInk);
    const int cut_a = corner.x + static_cast<int>((index(middle_, a) + 0.5) * pixels_per_voxel(a));
    const int cut_b =
        corner.y + height - 1 - static_cast<int>((index(middle_, b) + 0.5) * pixels_per_voxel(b));
    for (const int y : {corner.y - 7, corner.y + height + 1})
      cv::line(image_, {cut_a, y}, {cut_a, y + 5}, {40, 40, 220}, 2);
    for (const int x : {corner.x - 7, corner.x + width + 1})
      cv::line(image_, {x, cut_b}, {x + 5, cut_b}, {40, 40, 220}, 2);
    ticks(corner, a, b);
    const double at_m = workspace_.grid().centre_of(middle_)[static_cast<Eigen::Index>(c)];
    const char* names = "xyz";
    write(std::string(1, names[c]) + " = " + length_text(at_m) + " " + unit_name(),
          {corner.x + 4, corner.y - 10});
    write(std::string(1, names[a]) + " [" + unit_name() + "]",
          {corner.x + width - 44, corner.y + height + 34});
    write(std::string(1, names[b]) + " [" + unit_name() + "]", {corner.x - 62, corner.y + 4});
  }

  void ticks(cv::Point corner, std::size_t a, std::size_t b) {
    const auto& grid = workspace_.grid();
    const auto each = [&](std::size_t axis, auto draw) {
      const double from = grid.origin_m[static_cast<Eigen::Index>(axis)];
      const double to = from + grid.extent_m()[static_cast<Eigen::Index>(axis)];
      for (double at = std::ceil(from / step_m_) * step_m_; at <= to + 1e-9; at += step_m_) {
        const double clean = std::abs(at) < 1e-9 * step_m_ ? 0.0 : at;
        draw(static_cast<int>((at - from) * pixels_per_m_), length_text(clean));
      }
    };
    each(a, [&](int pixel, const std::string& label) {
      const cv::Point at(corner.x + pixel, corner.y + pixels_[b]);
      cv::line(image_, at, {at.x, at.y + 5}, kInk);
      write(label, {at.x - 4 * static_cast<int>(label.size()), at.y + 18});
    });
    each(b, [&](int pixel, const std::string& label) {
      const cv::Point at(corner.x, corner.y + pixels_[b] - pixel);
      if (at.y < corner.y + 16) return;  // the axis's name is written there
      cv::line(image_, at, {at.x - 5, at.y}, kInk);
      write(label, {at.x - 10 - 8 * static_cast<int>(label.size()), at.y + 4});
    });
  }

  void legend(cv::Point at) {
    for (const int order : present_.orders) {
      const cv::Vec3b colour = colours_.of(order);
      cv::rectangle(image_, {at.x, at.y, 18, 14}, cv::Scalar(colour[0], colour[1], colour[2]), cv::FILLED);
      cv::rectangle(image_, {at.x, at.y, 18, 14}, kLine);
      write(name_of(order, text_), {at.x + 26, at.y + 12});
      at.y += 20;
    }
  }

  void scale_bar(cv::Point at) {
    const int length = static_cast<int>(step_m_ * pixels_per_m_);
    cv::rectangle(image_, {at.x, at.y - 5, length, 5}, kInk, cv::FILLED);
    const workspace::VoxelSize& size = workspace_.grid().voxel_size_m;
    const std::string voxel =
        size.is_cube() ? core::formatted("%.4g", size[0] * 1e3)
                       : core::formatted("%.4g x %.4g x %.4g", size[0] * 1e3, size[1] * 1e3, size[2] * 1e3);
    write(length_text(step_m_) + " " + unit_name() + ", voxel " + voxel + " mm", {at.x + length + 8, at.y});
  }

  const Workspace& workspace_;
  const PictureText& text_;
  Present present_;
  Colours colours_;
  Index3 middle_;
  double pixels_per_m_ = 1.0, unit_ = 1.0, step_m_ = 1.0;
  std::array<int, 3> pixels_{};
  cv::Mat image_;
};

}  // namespace

std::vector<std::uint8_t> slice_picture(const Workspace& workspace, const PictureText& text) {
  return Drawing(workspace, text).png();
}

}  // namespace phantom::wva_server
