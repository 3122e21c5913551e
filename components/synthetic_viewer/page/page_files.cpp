#include "components/synthetic_viewer/page/page_files.hpp"

#include <array>

namespace phantom::synthetic_viewer {

namespace assets {  // files of web/
extern const char* const kTokensCss;
extern const char* const kPageCss;
extern const char* const kLayoutCss;
extern const char* const kReviewCss;
extern const char* const kLanguageJs;
extern const char* const kStopJs;
extern const char* const kChoiceJs;
extern const char* const kViewsJs;
extern const char* const kStreamJs;
extern const char* const kLayoutJs;
extern const char* const kAlarmsJs;
extern const char* const kDelaysJs;
extern const char* const kPanelsJs;
extern const char* const kPageJs;
extern const char* const kSessionJs;
extern const char* const kTourJs;
extern const char* const kReviewPlotsJs;
extern const char* const kReviewJs;
extern const char* const kCalibrateJs;
}  // namespace assets

std::span<const PageFile> page_files() {
  constexpr const char *kCss = "text/css; charset=utf-8", *kJs = "text/javascript; charset=utf-8";
  static const std::array files = std::to_array<PageFile>({
      {"/tokens.css", assets::kTokensCss, kCss},
      {"/page.css", assets::kPageCss, kCss},
      {"/layout.css", assets::kLayoutCss, kCss},
      {"/review.css", assets::kReviewCss, kCss},
      {"/language.js", assets::kLanguageJs, kJs},
      {"/stop.js", assets::kStopJs, kJs},
      {"/choice.js", assets::kChoiceJs, kJs},
      {"/views.js", assets::kViewsJs, kJs},
      {"/stream.js", assets::kStreamJs, kJs},
      {"/layout.js", assets::kLayoutJs, kJs},
      {"/alarms.js", assets::kAlarmsJs, kJs},
      {"/delays.js", assets::kDelaysJs, kJs},
      {"/panels.js", assets::kPanelsJs, kJs},
      {"/page.js", assets::kPageJs, kJs},
      {"/session.js", assets::kSessionJs, kJs},
      {"/tour.js", assets::kTourJs, kJs},
      {"/review_plots.js", assets::kReviewPlotsJs, kJs},
      {"/review.js", assets::kReviewJs, kJs},
      {"/calibrate.js", assets::kCalibrateJs, kJs},
  });
  return files;
}

}  // namespace phantom::synthetic_viewer
