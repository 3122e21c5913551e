#include "components/synthetic_viewer/window.hpp"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <spdlog/spdlog.h>

#include <cmath>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "components/synthetic_viewer/gl_objects.hpp"
#include "components/synthetic_viewer/hud.hpp"
#include "components/synthetic_viewer/pointer.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kKeyTurn_rad = 5.0 * core::kRadPerDegree;
constexpr double kDoubleClick_s = 0.35;

constexpr const char* kVertex = R"(#version 330 core
uniform vec4 place;  // left, top, right, bottom in clip coordinates
out vec2 texel;
void main() {
  vec2 at = vec2(float(gl_VertexID & 1), float((gl_VertexID & 2) >> 1));
  texel = at;
  gl_Position = vec4(mix(place.xy, place.zw, at), 0.0, 1.0);
}
)";
constexpr const char* kFragment = R"(#version 330 core
in vec2 texel;
uniform sampler2D picture;
out vec4 result;
void main() { result = vec4(texture(picture, texel).rgb, 1.0); }
)";

/// Initialises GLFW, and terminates it after all that uses it is destroyed.
struct Library {
  Library() {
    if (glfwInit() == GLFW_TRUE) return;
    const char* why = nullptr;
    glfwGetError(&why);
    throw core::MissingError(std::string("no desktop to open a window on: ") +
                             (why != nullptr ? why : "unknown reason"));
  }
  ~Library() { glfwTerminate(); }
};

/// The newest picture of a view as a texture.
struct Shown {
  GLuint texture = 0;
  std::uint64_t seen = 0;
  Broadcast<Image>::Content image;

  /// Takes the newest picture. Returns whether it is new.
  bool update(Broadcast<Image>& source) { return show(source.newest()); }
  bool show(const Broadcast<Image>::Content& newest) {
    if (newest == image) return false;
    image = newest;
    if (!image) return true;
    if (texture == 0) glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, image->width_px, image->height_px, 0, GL_BGR, GL_UNSIGNED_BYTE,
                 image->bgr.data());
    return true;
  }
};

}  // namespace

struct Window::Impl {
  Library library;
  PageContent& content;
  WindowActions actions;
  GLFWwindow* window = nullptr;
  GLuint program = 0, empty_array = 0;
  std::array<Shown, kViews.size()> shown;
  Shown banner;  // the banner of a stop
  std::string banner_words;
  bool banner_bright = false;
  int banner_width = 0;
  View selected = View::kMain;  // selected by keys
  std::optional<View> dragged;
  double pointer_x = 0, pointer_y = 0, clicked_s = -1;
  bool stale = true;

  Impl(const std::string& title, PageContent& page, WindowActions what)
      : content(page), actions(std::move(what)) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window = glfwCreateWindow(1280, 720, title.c_str(), nullptr, nullptr);
    if (window == nullptr) {
      const char* why = nullptr;
      glfwGetError(&why);
      throw core::MissingError(std::string("the desktop gives no window: ") +
                               (why != nullptr ? why : "unknown reason"));
    }
    glfwMakeContextCurrent(window);
    glfwSwapInterval(0);
    program = gl::link_program(kVertex, kFragment);
    glGenVertexArrays(1, &empty_array);
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
  void listen();
  WindowPlace place(View view) const;
  View under_pointer() const;
  void on_key(int key, int modifiers);
  void on_move(double x, double y);
  void on_button(bool pressed);
  bool update_banner();
  void draw_quad(const Shown& picture, const WindowPlace& at, int width, int height) const;
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
    of(from).actions.move(wheel_request(of(from).under_pointer(), notches));
  });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* from) { of(from).stale = true; });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* from, int, int) { of(from).stale = true; });
}

WindowPlace Window::Impl::place(View view) const {
  int width = 0, height = 0;
  glfwGetWindowSize(window, &width, &height);
  const auto& main = shown[static_cast<std::size_t>(View::kMain)].image;
  const double aspect = main ? static_cast<double>(main->width_px) / main->height_px : 16.0 / 9;
  return place_in_window(view, width, height, aspect);
}

View Window::Impl::under_pointer() const {
  for (const View view : {View::kHit, View::kTool}) {
    if (shown[static_cast<std::size_t>(view)].image && place(view).contains(pointer_x, pointer_y))
      return view;
  }
  return View::kMain;
}

void Window::Impl::on_move(double x, double y) {
  if (dragged) actions.move(drag_request(*dragged, x - pointer_x, y - pointer_y, place(*dragged).height));
  pointer_x = x;
  pointer_y = y;
}

void Window::Impl::on_button(bool pressed) {
  dragged.reset();
  if (!pressed) return;
  dragged = under_pointer();
  const double now_s = glfwGetTime();
  if (clicked_s >= 0 && now_s - clicked_s < kDoubleClick_s) actions.move({.view = *dragged, .home = true});
  clicked_s = now_s;
}

void Window::Impl::on_key(int key, int modifiers) {
  if ((modifiers & (GLFW_MOD_CONTROL | GLFW_MOD_ALT | GLFW_MOD_SUPER)) != 0) return;
  const ViewSwitches now = actions.switches();
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return actions.command({CommandKind::kEmergencyStop, 0.0});
    case GLFW_KEY_H:
      return actions.command({CommandKind::kViewHold, now.hold ? 0.0 : 1.0});
    case GLFW_KEY_R:
      return actions.move({.view = selected, .record = !now.recording});
    case GLFW_KEY_TAB:
      selected = kViews[(static_cast<std::size_t>(selected) + 1) % kViews.size()];
      return glfwSetWindowTitle(
          window, (std::string("Phantom - keys move the ") + name_of(selected) + " view").c_str());
    case GLFW_KEY_HOME:
      return actions.move({.view = selected, .home = true});
    case GLFW_KEY_LEFT:
    case GLFW_KEY_RIGHT:
      return actions.move(
          {.view = selected, .azimuth_rad = key == GLFW_KEY_LEFT ? -kKeyTurn_rad : kKeyTurn_rad});
    case GLFW_KEY_UP:
    case GLFW_KEY_DOWN:
      return actions.move(
          {.view = selected, .elevation_rad = key == GLFW_KEY_UP ? kKeyTurn_rad : -kKeyTurn_rad});
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      return actions.move(wheel_request(selected, 1));
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return actions.move(wheel_request(selected, -1));
    default:
      break;
  }
  // GLFW's key codes of letters and digits are their character codes.
  const auto node = key > 0 && key < 128 ? node_of_key(static_cast<char>(key)) : std::nullopt;
  if (node) actions.command({CommandKind::kViewNode, static_cast<double>(*node)});
}

/// Updates the banner over the views from the stops in force, without waiting for a picture. Returns whether
/// it changed.
bool Window::Impl::update_banner() {
  if (!actions.stops) return false;
  constexpr double kBlink_s = 0.3;
  const StopView view = actions.stops();
  std::string words =
      view.in_force ? view.headline + "\nmaster: " + view.sides[0].text + "\nslave: " + view.sides[1].text
                    : "";
  for (const std::string& notice : view.notices) words += (words.empty() ? "" : "\n") + notice;
  const bool bright = view.alarm && std::fmod(glfwGetTime(), 2 * kBlink_s) < kBlink_s;
  int width = 0, height = 0;
  glfwGetWindowSize(window, &width, &height);
  if (words == banner_words && bright == banner_bright && width == banner_width) return false;
  banner_words = std::move(words);
  banner_bright = bright;
  banner_width = width;
  if (banner_words.empty() || width <= 0) return banner.show(nullptr);
  return banner.show(std::make_shared<const Image>(banner_image(banner_words, width, bright)));
}

void Window::Impl::draw_quad(const Shown& picture, const WindowPlace& at, int width, int height) const {
  const auto clip_x = [&](double x) { return static_cast<float>(2 * x / width - 1); };
  const auto clip_y = [&](double y) { return static_cast<float>(1 - 2 * y / height); };
  glBindTexture(GL_TEXTURE_2D, picture.texture);
  glUniform4f(glGetUniformLocation(program, "place"), clip_x(at.x), clip_y(at.y), clip_x(at.x + at.width),
              clip_y(at.y + at.height));
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void Window::Impl::draw() {
  int width = 0, height = 0, pixels_x = 0, pixels_y = 0;
  glfwGetWindowSize(window, &width, &height);
  glfwGetFramebufferSize(window, &pixels_x, &pixels_y);
  if (width <= 0 || height <= 0) return;
  glViewport(0, 0, pixels_x, pixels_y);
  glClearColor(0.04F, 0.05F, 0.06F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  glUseProgram(program);
  glBindVertexArray(empty_array);
  for (const View view : kViews) {
    const Shown& picture = shown[static_cast<std::size_t>(view)];
    if (!picture.image) continue;
    draw_quad(picture, place(view), width, height);
  }
  if (banner.image) {
    draw_quad(banner, {0, 0, static_cast<double>(width), static_cast<double>(banner.image->height_px)}, width,
              height);
  }
  glfwSwapBuffers(window);
}

Window::Window(const std::string& title, PageContent& content, WindowActions actions)
    : impl_(std::make_unique<Impl>(title, content, std::move(actions))) {
  spdlog::info("window open; {}", kWindowHelp);
}

Window::~Window() = default;

bool Window::turn(double seconds) {
  const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(seconds);
  do {
    glfwWaitEventsTimeout(0.015);
    for (const View view : kViews) {
      if (impl_->shown[static_cast<std::size_t>(view)].update(impl_->content.view(view).image))
        impl_->stale = true;
    }
    if (impl_->update_banner()) impl_->stale = true;
    if (std::exchange(impl_->stale, false)) impl_->draw();
  } while (core::monotonic_ns() < until_ns && !glfwWindowShouldClose(impl_->window));
  return glfwWindowShouldClose(impl_->window) == 0;
}

}  // namespace phantom::synthetic_viewer
