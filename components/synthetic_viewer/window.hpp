#pragma once

#include <functional>
#include <memory>
#include <string>

#include "components/synthetic_viewer/page_content.hpp"

namespace phantom::synthetic_viewer {

/// What the window asks for; each is called on the window's thread.
struct WindowActions {
  std::function<void(const ViewRequest&)> move;
  std::function<void(const Command&)> command;
  std::function<ViewSwitches()> switches;
  std::function<StopView()> stops;  ///< what is to be shown of a stop
};

/// A window on this host's desktop: the main view, over it the hit zone (right above) and the end-effector's
/// view (right below) where there are any. Drag turns the view under the pointer, the wheel zooms it, a
/// double click brings it home; keys: see kWindowHelp. Over all of them stands who is stopped, and in
/// alternating red who has not confirmed it. Shows finished pictures only: a slow desktop costs the drawing
/// thread nothing.
class Window {
 public:
  /// On the main thread, as all else here. Throws core::MissingError if there is no display to open it on.
  Window(const std::string& title, PageContent& content, WindowActions actions);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Handles input and shows what is new, for about `seconds`. False once the user has closed it.
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
