#pragma once

#include <functional>
#include <memory>
#include <string>

#include "components/synthetic_viewer/stream/page_content.hpp"

namespace phantom::synthetic_viewer {

/// A window on this host's desktop: the main view and, over it, the hit zone (top right) and the
/// end-effector's view (bottom right) where there are any. Dragging turns the view under the pointer, the
/// wheel zooms it, and a double click resets it; keys: see kWindowHelp. Above all views a banner shows which
/// sides are stopped and, in blinking red, which have not confirmed a stop. The window shows finished
/// pictures only, so that a slow desktop costs the drawing thread nothing.
class Window {
 public:
  using OnViewRequest = std::function<void(const ViewRequest&)>;
  using OnCommand = std::function<void(const Command&)>;

  /// Opens the window. Use the class on the main thread only; it calls the callbacks there. Throws
  /// core::MissingError if there is no display.
  Window(const std::string& title, PageContent& content, OnViewRequest on_view_request, OnCommand on_command,
         Language language = Language::kEnglish);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Handles input and shows new pictures, for about `seconds`. Returns false once the user has closed the
  /// window.
  bool turn(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr const char* kWindowHelp =
    "drag: turn    wheel, + -: zoom    arrows: turn    Home: back    Tab: other view\n"
    "N S E W T B 1-8: look at the hit zone from    A: automatic    H: hold or release    R: record    Esc: "
    "emergency stop";

}  // namespace phantom::synthetic_viewer
