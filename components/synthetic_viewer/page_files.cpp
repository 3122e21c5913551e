#include "components/synthetic_viewer/page_files.hpp"

#include <array>

namespace phantom::synthetic_viewer {

namespace web {  // files of web/
extern const char* const kTokensCss;
extern const char* const kPageCss;
extern const char* const kReviewCss;
extern const char* const kLanguageJs;
extern const char* const kStopJs;
extern const char* const kChoiceJs;
extern const char* const kViewsJs;
extern const char* const kStreamJs;
extern const char* const kPageJs;
extern const char* const kSessionJs;
extern const char* const kReviewPlotsJs;
extern const char* const kReviewJs;
extern const char* const kCalibrateJs;
}  // namespace web

std::span<const PageFile> page_files() {
  constexpr const char *kCss = "text/css; charset=utf-8", *kJs = "text/javascript; charset=utf-8";
  static const std::array files = std::to_array<PageFile>({
      {"/tokens.css", web::kTokensCss, kCss},
      {"/page.css", web::kPageCss, kCss},
      {"/review.css", web::kReviewCss, kCss},
      {"/language.js", web::kLanguageJs, kJs},
      {"/stop.js", web::kStopJs, kJs},
      {"/choice.js", web::kChoiceJs, kJs},
      {"/views.js", web::kViewsJs, kJs},
      {"/stream.js", web::kStreamJs, kJs},
      {"/page.js", web::kPageJs, kJs},
      {"/session.js", web::kSessionJs, kJs},
      {"/review_plots.js", web::kReviewPlotsJs, kJs},
      {"/review.js", web::kReviewJs, kJs},
      {"/calibrate.js", web::kCalibrateJs, kJs},
  });
  return files;
}

}  // namespace phantom::synthetic_viewer
