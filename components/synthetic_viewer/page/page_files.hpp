#pragma once

#include <span>
#include <string_view>

namespace phantom::synthetic_viewer {

/// A script or style sheet of the page. The page cannot log anybody in without them, so they are given
/// without a session.
struct PageFile {
  std::string_view path;  ///< as it is asked for: "/page.js"
  const char* text;
  const char* type;  ///< Content-Type
};

/// Returns the files of web/ that the page loads; they live as long as the process. Thread-safe.
std::span<const PageFile> page_files();

}  // namespace phantom::synthetic_viewer
