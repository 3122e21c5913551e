#pragma once
// A real browser for tests: Chromium, steered over the W3C WebDriver protocol through chromedriver.

#include <httplib.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace phantom::synthetic_viewer::test {

/// Returns the bytes of a text in base64.
std::string from_base64(const std::string& text);

class Browser {
 public:
  /// Starts both. `more`: arguments of Chromium. Throws std::runtime_error with chromedriver's words if that
  /// fails.
  explicit Browser(const std::vector<std::string>& more = {});
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  /// Whether this machine has them.
  static bool installed();

  /// Opens a page in the window that is steered. Returns once its scripts have run; pictures may still be on
  /// their way. Throws std::runtime_error.
  void open(const std::string& url);
  /// Another window of the same browser, which is steered from then on. Its handle.
  std::string open_window(const std::string& url);
  /// The window that is steered now.
  std::string window();
  void switch_to(const std::string& handle);
  /// The handles of all windows.
  std::vector<std::string> windows();
  /// What follows is done within a frame of the page, until it is left.
  void enter_frame(const std::string& selector);
  void leave_frame();
  /// Moves the mouse to the middle of an element.
  void hover(const std::string& selector);
  /// A mouse click in the middle of an element.
  void click(const std::string& selector);
  /// Runs JavaScript in the page: what `return` gives.
  nlohmann::json run(const std::string& script);
  /// Presses and releases keys, one after the other; special ones by WebDriver's code points.
  void type(const std::vector<std::string>& keys);
  /// Drags with the left button from the middle of an element by so many pixels.
  void drag(const std::string& selector, int dx, int dy);
  void wheel(const std::string& selector, int delta_y);
  /// PNG of the page as it stands in its window.
  std::string screenshot();

  /// Makes the window a screen of that size, CSS pixels; `touch`: one that is touched, without a mouse.
  void show_on(int width_px, int height_px, bool touch);
  /// Touches the page with fingers at these points (x, y), and moves them; none: they leave.
  void touch(const char* kind, const std::vector<std::array<double, 2>>& points);

  static constexpr const char* kEscape = "\uE00C";
  static constexpr const char* kTab = "\uE004";
  static constexpr const char* kLeft = "\uE012";
  static constexpr const char* kDown = "\uE015";
  static constexpr const char* kEnter = "\uE007";
  static constexpr const char* kHome = "\uE011";

 private:
  /// Starts chromedriver. Returns its port, or 0 if it has ended; `said`: its words.
  int start_driver(std::string& said);
  nlohmann::json begin(const nlohmann::json& wanted);
  nlohmann::json post(const std::string& path, const nlohmann::json& body);
  nlohmann::json element(const std::string& selector);
  void send_command(const std::string& command, const nlohmann::json& parameters);
  void act(const nlohmann::json& actions);

  pid_t driver_ = -1;
  int output_ = -1;
  std::optional<httplib::Client> client_;
  std::string session_;
};

}  // namespace phantom::synthetic_viewer::test
