#include "components/synthetic_viewer/scene/hud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

const cv::Scalar kText(236, 232, 226), kFaint(176, 166, 152), kDark(24, 20, 17), kTrack(62, 54, 47),
    kRed(56, 52, 226), kAmber(30, 160, 245), kBlue(214, 160, 86);

/// Returns a text as the font can write it: German letters as they are spelled without it, the minus sign as
/// a hyphen.
std::string spelled(const std::string& text) {
  static const std::pair<std::string_view, std::string_view> kSpellings[] = {
      {"ä", "ae"}, {"ö", "oe"}, {"ü", "ue"}, {"Ä", "AE"}, {"Ö", "OE"},
      {"Ü", "UE"}, {"ß", "ss"}, {"−", "-"},  {"–", "-"}};
  std::string all = text;
  for (const auto& [letter, spelling] : kSpellings)
    for (std::size_t at = 0; (at = all.find(letter, at)) != std::string::npos; at += spelling.size())
      all.replace(at, letter.size(), spelling);
  return all;
}

constexpr double kStrip = 62;  // height of the strip of gauges

/// Pixels per unit of a picture of that height; lengths are in pixels of a picture 720 high.
double unit_of(int height_px) noexcept { return std::max(0.72, height_px / 720.0); }

/// Draws on a picture; lengths are in pixels of a picture 720 high.
class Brush {
 public:
  explicit Brush(const cv::Mat& on) : Brush(on, unit_of(on.rows)) {}
  Brush(const cv::Mat& on, double unit_px) : picture(on), unit_(unit_px) {}

  int px(double units) const { return static_cast<int>(std::lround(units * unit_)); }
  int width() const { return picture.cols; }
  int height() const { return picture.rows; }

  cv::Size size_of(const std::string& text, double size) const {
    int baseline = 0;
    return cv::getTextSize(spelled(text), cv::FONT_HERSHEY_DUPLEX, size * unit_ / 30, 1, &baseline);
  }
  void write(const std::string& text, cv::Point left_base, double size, const cv::Scalar& colour) {
    const int thickness = size * unit_ > 32 ? 2 : 1;
    cv::putText(picture, spelled(text), left_base, cv::FONT_HERSHEY_DUPLEX, size * unit_ / 30, colour,
                thickness, cv::LINE_AA);
  }
  /// Blends a colour into a rectangle.
  void shade(cv::Rect area, const cv::Scalar& colour, double share) {
    area &= cv::Rect(0, 0, picture.cols, picture.rows);
    if (area.empty()) return;
    cv::Mat part = picture(area);
    cv::addWeighted(part, 1 - share, cv::Mat(part.size(), part.type(), colour), share, 0, part);
  }

  cv::Mat picture;

 private:
  double unit_;
};

/// Writes a faint label above a value. Returns the x at which the next one may begin.
int write_pair(Brush& brush, int x, const std::string& label, const std::string& value,
               const cv::Scalar& colour) {
  const int base = brush.height() - brush.px(14);
  brush.write(label, {x, base - brush.px(24)}, 13, kFaint);
  brush.write(value, {x, base}, 18, colour);
  return x + std::max(brush.size_of(label, 13).width, brush.size_of(value, 18).width) + brush.px(34);
}

cv::Scalar bar_colour(double closeness) { return closeness < 0.4 ? kBlue : closeness < 0.75 ? kAmber : kRed; }

int draw_closeness(Brush& brush, const Hud& hud, int x) {
  const int width = brush.px(150), base = brush.height() - brush.px(14), height = brush.px(13);
  brush.write(in(hud.language, {"hud.closeness", {}}), {x, base - brush.px(24)}, 13, kFaint);
  const cv::Rect track(x, base - height, width, height);
  cv::rectangle(brush.picture, track, kTrack, cv::FILLED);
  if (hud.closeness_known) {
    const double share = std::clamp(hud.closeness, 0.0, 1.0);
    const cv::Rect bar(track.x, track.y, static_cast<int>(track.width * share), track.height);
    cv::rectangle(brush.picture, bar, bar_colour(share), cv::FILLED);
  } else {
    cv::line(brush.picture, track.tl(), track.br(), kFaint, 1, cv::LINE_AA);
  }
  brush.write(hud.closeness_known ? fmt::format("{:.2f}", hud.closeness) : "-",
              {x + width + brush.px(10), base}, 18, kText);
  return x + width + brush.px(74);
}

void draw_gauges(Brush& brush, const Hud& hud) {
  brush.shade({0, brush.height() - brush.px(kStrip), brush.width(), brush.px(kStrip)}, kDark, 0.62);
  int x = draw_closeness(brush, hud, brush.px(22));
  x = write_pair(brush, x, in(hud.language, {"hud.speed", {}}),
                 hud.closeness_known ? fmt::format("{:.3f} m/s", hud.speed_m_s) : "-", kText);
  const bool known = hud.closeness_known;
  const cv::Scalar motion_colour = known && hud.motion == MotionClass::kDangerous ? kRed
                                   : known && hud.motion == MotionClass::kNeutral ? kAmber
                                                                                  : kText;
  const LocalizedText motion{std::string("motion.") + name_of(hud.motion), {}};
  x = std::max(x, brush.px(375));  // keeps the columns in place when the numbers' widths change
  write_pair(brush, x, in(hud.language, {"hud.motion", {}}), known ? in(hud.language, motion) : "-",
             motion_colour);
  write_pair(brush, x + brush.px(125), in(hud.language, {"hud.nearest", {}}), hud.nearest, kText);
  if (brush.width() < brush.px(1180)) return;  // no room for more
  int right = brush.width() - brush.px(22);
  write_pair(brush, right -= brush.px(92), in(hud.language, {"hud.voxel_error", {}}), hud.voxel_error, kText);
  write_pair(brush, right -= brush.px(110), in(hud.language, {"hud.model_age", {}}), hud.model_age, kText);
  write_pair(brush, right -= brush.px(175), in(hud.language, {"hud.link", {}}), hud.link_quality, kText);
  write_pair(brush, right -= brush.px(125), in(hud.language, {"hud.slave", {}}), hud.link_state, kText);
}

/// Draws the lines of `text` across the picture's width, the first one largest, scaled down to fit.
void draw_banner(Brush& brush, const std::string& text, int top) {
  if (text.empty()) return;
  std::istringstream lines(text);
  double size = 34;
  for (std::string line; std::getline(lines, line); size = 24) {
    const double widest = brush.width() - 2.0 * brush.px(12);
    const double fitting = size * std::min(1.0, widest / std::max(1, brush.size_of(line, size).width));
    const int height = brush.px(2.18 * size), width = brush.size_of(line, fitting).width;
    brush.shade({0, top, brush.width(), height}, cv::Scalar(24, 20, 120), 0.78);
    brush.write(line, {(brush.width() - width) / 2, top + brush.px(1.44 * size)}, fitting,
                cv::Scalar(255, 255, 255));
    top += height;
  }
}

void draw_titles(Brush& brush, const Hud& hud) {
  const int x = brush.px(22);
  if (!hud.title.empty()) {
    const cv::Size size = brush.size_of(hud.title, 21), below = brush.size_of(hud.subtitle, 15);
    const int height = brush.px(hud.subtitle.empty() ? 44 : 68);
    brush.shade({0, 0, std::max(size.width, below.width) + brush.px(50), height}, kDark, 0.55);
    brush.write(hud.title, {x, brush.px(31)}, 21, hud.alarm ? kRed : kText);
    if (!hud.subtitle.empty()) brush.write(hud.subtitle, {x, brush.px(56)}, 15, kFaint);
  }
  draw_banner(brush, hud.banner, brush.height() / 5);
}

std::string encode(const Image& image, const char* kind, const std::vector<int>& parameters) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(kind, image, bytes, parameters)) {
    throw std::runtime_error(std::string("cannot encode a picture as ") + kind);
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace

double gauges_share(int height_px) noexcept { return kStrip * unit_of(height_px) / height_px; }

void draw_hud(Image& image, const Hud& hud) {
  Brush brush(image);
  if (hud.gauges) draw_gauges(brush, hud);
  draw_titles(brush, hud);
  if (hud.recording) {
    cv::circle(image, {image.cols - brush.px(28), brush.px(28)}, brush.px(9), kRed, cv::FILLED, cv::LINE_AA);
  }
  if (hud.alarm) cv::rectangle(image, {0, 0, image.cols, image.rows}, kRed, 2 * brush.px(4));
}

void draw_inset(Image& image, const Image& inset) {
  const Brush brush(image);
  const int width = image.cols / 4, height = std::max(1, width * inset.rows / std::max(1, inset.cols));
  const int border = brush.px(2), margin = brush.px(14);
  const cv::Rect place(image.cols - width - margin, margin, width, height);
  if ((place & cv::Rect(0, 0, image.cols, image.rows)) != place) return;
  cv::resize(inset, image(place), place.size(), 0, 0, cv::INTER_AREA);
  cv::rectangle(image, place, kText, border);
}

Image banner_image(const std::string& text, int width_px, bool alarm) {
  const cv::Scalar ground = alarm ? cv::Scalar(30, 24, 190) : cv::Scalar(24, 20, 120);
  const auto lines = static_cast<int>(1 + std::count(text.begin(), text.end(), '\n'));
  Image image(74 + 53 * (lines - 1), width_px, CV_8UC3, ground);
  // The same scale as on a picture of this width.
  Brush brush(image, 1.0);
  draw_banner(brush, text, 0);
  return image;
}

std::string encode_jpeg(const Image& image, int quality) {
  return encode(image, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

std::string encode_png(const Image& image) { return encode(image, ".png", {cv::IMWRITE_PNG_COMPRESSION, 3}); }

}  // namespace phantom::synthetic_viewer
