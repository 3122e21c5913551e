#pragma once

namespace phantom::synthetic_viewer::web {

// The files of web/, embedded in the executable by embed.cmake.
extern const char* const kIndexHtml;
extern const char* const kPageCss;
extern const char* const kPageJs;
extern const char* const kStopJs;

}  // namespace phantom::synthetic_viewer::web
