#include "components/synthetic_viewer/output/window.hpp"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdlib>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"
#include "components/synthetic_viewer/state/camera_control.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kKeyTurn_rad = 5.0 * core::kRadPerDegree;
constexpr double kDoubleClick_s = 0.35;

[[noreturn]] void fail(const std::string& what) {
  const char* why = nullptr;
  glfwGetError(&why);
  throw core::MissingError(what + ": " + (why != nullptr ? why : "unknown reason"));
}

/// Initialises GLFW, and terminates it after all that uses it is destroyed.
struct Library {
  Library() {
    if (glfwInit() == GLFW_TRUE) return;
    const bool named = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
    fail(named ? "no desktop to open a window on"
               : "no desktop to open a window on (neither DISPLAY nor WAYLAND_DISPLAY is set)");
  }
  ~Library() { glfwTerminate(); }
};

/// A picture in a framebuffer of its own.
struct Shown {
  GLuint frame = 0, texture = 0;
  web::Broadcast<Image>::Content image;

  /// Takes a picture. Returns whether it is another than before.
  bool show(const web::Broadcast<Image>::Content& newest) {
    if (newest == image) return false;
    image = newest;
    if (!image) return true;
    if (texture == 0) glGenTextures(1, &texture);
    if (frame == 0) glGenFramebuffers(1, &frame);
    glBindTexture(GL_TEXTURE_2D, texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, image->cols, image->rows, 0, GL_BGR, GL_UNSIGNED_BYTE,
                 image->data);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, frame);
    glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    return true;
  }
};

}  // namespace

struct Window::Impl {
  Library library;
  PageContent& content;
  OnViewRequest move;
  OnCommand command;
  Language language;
  GLFWwindow* window = nullptr;
  std::array<Shown, kViews.size()> shown;
  Shown banner;  // the banner of a stop
  std::string banner_lines;
  bool banner_bright = false;
  int banner_width = 0;
  View selected = View::kMain;  // selected by keys
  std::optional<View> dragged;
  double pointer_x = 0, pointer_y = 0, clicked_s = -1;
  bool stale = true;

  Impl(const std::string& title, PageContent& page, OnViewRequest on_view_request, OnCommand on_command,
       Language writes)
      : content(page), move(std::move(on_view_request)), command(std::move(on_command)), language(writes) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window = glfwCreateWindow(1280, 720, title.c_str(), nullptr, nullptr);
    if (window == nullptr) fail("the desktop gives no window");
    glfwMakeContextCurrent(window);
    glfwSwapInterval(0);
    glfwSetWindowUserPointer(window, this);
    listen();
    for (const View view : kViews) content.view(view).image.followers.fetch_add(1);
  }
  ~Impl() {
    if (window == nullptr) return;
    for (const View view : kViews) content.view(view).image.followers.fetch_sub(1);
    glfwDestroyWindow(window);
  }

  static Impl& of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }
  Shown& shown_of(View view) { return shown[static_cast<std::size_t>(view)]; }
  void listen();
  cv::Rect2d place(View view);
  View under_pointer();
  void on_key(int key, int modifiers);
  void on_move(double x, double y);
  void on_button(bool pressed);
  bool update_banner();
  void draw();
};

void Window::Impl::listen() {
  glfwSetKeyCallback(window, [](GLFWwindow* from, int key, int, int action, int modifiers) {
    if (action != GLFW_RELEASE) of(from).on_key(key, modifiers);
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* from, double x, double y) { of(from).on_move(x, y); });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* from, int button, int action, int) {
    if (button == GLFW_MOUSE_BUTTON_LEFT) of(from).on_button(action == GLFW_PRESS);
  });
  glfwSetScrollCallback(window, [](GLFWwindow* from, double, double notches) {
    of(from).move(wheel_request(of(from).under_pointer(), notches));
  });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* from) { of(from).stale = true; });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* from, int, int) { of(from).stale = true; });
}

cv::Rect2d Window::Impl::place(View view) {
  int width = 0, height = 0;
  glfwGetWindowSize(window, &width, &height);
  const auto& main = shown_of(View::kMain).image;
  return place_in_window(view, width, height, main ? static_cast<double>(main->cols) / main->rows : 16.0 / 9);
}

View Window::Impl::under_pointer() {
  for (const View view : {View::kHit, View::kTool, View::kCamera}) {
    if (shown_of(view).image && place(view).contains(cv::Point2d(pointer_x, pointer_y))) return view;
  }
  return View::kMain;
}

void Window::Impl::on_move(double x, double y) {
  if (dragged) move(drag_request(*dragged, x - pointer_x, y - pointer_y, place(*dragged).height));
  pointer_x = x;
  pointer_y = y;
}

void Window::Impl::on_button(bool pressed) {
  dragged.reset();
  if (!pressed) return;
  dragged = under_pointer();
  const double now_s = glfwGetTime();
  if (clicked_s >= 0 && now_s - clicked_s < kDoubleClick_s) move({.view = *dragged, .home = true});
  clicked_s = now_s;
}

void Window::Impl::on_key(int key, int modifiers) {
  if ((modifiers & (GLFW_MOD_CONTROL | GLFW_MOD_ALT | GLFW_MOD_SUPER)) != 0) return;
  const ViewSwitches now = content.switches.newest_or_default();
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return command({.kind = CommandKind::kEmergencyStop});
    case GLFW_KEY_H:
      return command({.kind = CommandKind::kViewHold, .value = now.hold ? 0.0 : 1.0});
    case GLFW_KEY_R:
      return move({.view = selected, .record = !now.recording});
    case GLFW_KEY_TAB:
      selected = kViews[(static_cast<std::size_t>(selected) + 1) % kViews.size()];
      return glfwSetWindowTitle(
          window, (std::string("Phantom - keys move the ") + name_of(selected) + " view").c_str());
    case GLFW_KEY_HOME:
      return move({.view = selected, .home = true});
    case GLFW_KEY_LEFT:
      return move({.view = selected, .azimuth_rad = -kKeyTurn_rad});
    case GLFW_KEY_RIGHT:
      return move({.view = selected, .azimuth_rad = kKeyTurn_rad});
    case GLFW_KEY_UP:
      return move({.view = selected, .elevation_rad = kKeyTurn_rad});
    case GLFW_KEY_DOWN:
      return move({.view = selected, .elevation_rad = -kKeyTurn_rad});
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      return move(wheel_request(selected, 1));
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return move(wheel_request(selected, -1));
    default:
      break;
  }
  // GLFW's key codes of letters and digits are their character codes.
  const auto node = key > 0 && key < 128 ? node_of_key(static_cast<char>(key)) : std::nullopt;
  if (node) command({.kind = CommandKind::kViewNode, .value = static_cast<double>(*node)});
}

/// Updates the banner over the views from the stops in force, without waiting for a picture. Returns whether
/// it changed.
bool Window::Impl::update_banner() {
  if (!content.stops) return false;
  constexpr double kBlink_s = 0.3;
  const StopView view = content.stops();
  std::string words =
      view.in_force ? in(language, view.headline_words) + "\n" + sides_text(view, language, "\n") : "";
  for (const LocalizedText& notice : view.notice_words) {
    if (!words.empty()) words += '\n';
    words += in(language, notice);
  }
  const bool bright = view.alarm && std::fmod(glfwGetTime(), 2 * kBlink_s) < kBlink_s;
  int width = 0, height = 0;
  glfwGetWindowSize(window, &width, &height);
  if (words == banner_lines && bright == banner_bright && width == banner_width) return false;
  banner_lines = std::move(words);
  banner_bright = bright;
  banner_width = width;
  if (banner_lines.empty() || width <= 0) return banner.show(nullptr);
  return banner.show(std::make_shared<const Image>(banner_image(banner_lines, width, bright)));
}

void Window::Impl::draw() {
  int width = 0, height = 0, pixels_x = 0, pixels_y = 0;
  glfwGetWindowSize(window, &width, &height);
  glfwGetFramebufferSize(window, &pixels_x, &pixels_y);
  if (width <= 0 || height <= 0) return;
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glClearColor(0.04F, 0.05F, 0.06F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  // The window's coordinates run downwards, as the pictures' rows do, and those of the framebuffer upwards.
  const auto draw_at = [&](const Shown& picture, const cv::Rect2d& at) {
    const auto x = [&](double window_x) {
      return static_cast<GLint>(std::lround(window_x * pixels_x / width));
    };
    const auto y = [&](double window_y) {
      return pixels_y - static_cast<GLint>(std::lround(window_y * pixels_y / height));
    };
    glBindFramebuffer(GL_READ_FRAMEBUFFER, picture.frame);
    glBlitFramebuffer(0, 0, picture.image->cols, picture.image->rows, x(at.x), y(at.y), x(at.x + at.width),
                      y(at.y + at.height), GL_COLOR_BUFFER_BIT, GL_LINEAR);
  };
  for (const View view : kViews) {
    if (shown_of(view).image) draw_at(shown_of(view), place(view));
  }
  if (banner.image)
    draw_at(banner, {0, 0, static_cast<double>(width), static_cast<double>(banner.image->rows)});
  glfwSwapBuffers(window);
}

Window::Window(const std::string& title, PageContent& content, OnViewRequest on_view_request,
               OnCommand on_command, Language language)
    : impl_(std::make_unique<Impl>(title, content, std::move(on_view_request), std::move(on_command),
                                   language)) {
  spdlog::info("window open; {}", kWindowHelp);
}

Window::~Window() = default;

bool Window::turn(double seconds) {
  const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(seconds);
  do {
    glfwWaitEventsTimeout(0.015);
    for (const View view : kViews)
      impl_->stale |= impl_->shown_of(view).show(impl_->content.view(view).image.newest());
    impl_->stale |= impl_->update_banner();
    if (std::exchange(impl_->stale, false)) impl_->draw();
  } while (core::monotonic_ns() < until_ns && !glfwWindowShouldClose(impl_->window));
  return glfwWindowShouldClose(impl_->window) == 0;
}

}  // namespace phantom::synthetic_viewer
