// The desktop window, under an X server of the test's own (Xvfb); pixels and input by Xlib.
#include "components/synthetic_viewer/output/window.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/state/camera_control.hpp"

// Last: it defines short names.
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/keysym.h>

namespace phantom::synthetic_viewer {
namespace {

constexpr const char* kServer = "/usr/bin/Xvfb";
constexpr unsigned long kBlue = 0x0000E0;

Image plain(std::uint8_t blue, std::uint8_t green, std::uint8_t red) {
  return Image(180, 320, CV_8UC3, cv::Scalar(blue, green, red));
}

class Desktop : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kServer)) GTEST_SKIP() << "xvfb is not installed (scripts/setup)";
    start_server();
    display_ = XOpenDisplay(name_.c_str());
    ASSERT_NE(display_, nullptr);
    setenv("DISPLAY", name_.c_str(), 1);
    unsetenv("WAYLAND_DISPLAY");
  }
  void TearDown() override {
    window_.reset();
    if (display_ != nullptr) XCloseDisplay(display_);
    if (server_ > 0) {
      kill(server_, SIGTERM);
      waitpid(server_, nullptr, 0);
    }
    unsetenv("DISPLAY");
  }
  void open() {
    content_.stops = [this] { return stops_; };
    window_ = std::make_unique<Window>(
        "window test", content_, [this](const ViewRequest& request) { requests_.push_back(request); },
        [this](const Command& command) { commands_.push_back(command); });
    ASSERT_TRUE(turn_until([this] { return (handle_ = find("window test")) != 0; }));
  }
  /// Lets the window work until the condition holds.
  bool turn_until(const std::function<bool()>& condition) {
    for (int k = 0; k < 1000; ++k) {
      window_->turn(0.02);
      if (condition()) return true;
    }
    return false;
  }
  unsigned long pixel(int x, int y) {
    XImage* image = XGetImage(display_, handle_, x, y, 1, 1, AllPlanes, ZPixmap);
    if (image == nullptr) return 0;
    const unsigned long value = XGetPixel(image, 0, 0) & 0xFFFFFF;
    XDestroyImage(image);
    return value;
  }
  void press(KeySym key) {
    XKeyEvent event{};
    event.type = KeyPress;
    event.display = display_;
    event.window = handle_;
    event.root = DefaultRootWindow(display_);
    event.keycode = XKeysymToKeycode(display_, key);
    event.same_screen = True;
    event.time = CurrentTime;
    send(KeyPressMask, reinterpret_cast<XEvent&>(event));
    event.type = KeyRelease;
    send(KeyReleaseMask, reinterpret_cast<XEvent&>(event));
  }
  void button(bool down, unsigned int which, int x, int y) {
    XButtonEvent event{};
    event.type = down ? ButtonPress : ButtonRelease;
    event.display = display_;
    event.window = handle_;
    event.button = which;
    event.x = x;
    event.y = y;
    event.same_screen = True;
    send(down ? ButtonPressMask : ButtonReleaseMask, reinterpret_cast<XEvent&>(event));
  }
  void move_to(int x, int y) {
    XMotionEvent event{};
    event.type = MotionNotify;
    event.display = display_;
    event.window = handle_;
    event.x = x;
    event.y = y;
    event.same_screen = True;
    send(PointerMotionMask, reinterpret_cast<XEvent&>(event));
  }

  PageContent content_;
  std::vector<ViewRequest> requests_;
  std::vector<Command> commands_;
  StopView stops_;
  std::unique_ptr<Window> window_;
  ::Window handle_ = 0;
  Display* display_ = nullptr;

 private:
  void start_server() {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    server_ = fork();
    if (server_ == 0) {
      const std::string number = std::to_string(ends[1]);
      execl(kServer, kServer, "-displayfd", number.c_str(), "-screen", "0", "1400x900x24", "-nolisten", "tcp",
            static_cast<char*>(nullptr));
      _exit(127);
    }
    close(ends[1]);
    char byte = 0;
    std::string number;
    while (read(ends[0], &byte, 1) == 1 && byte != '\n') number += byte;
    close(ends[0]);
    ASSERT_FALSE(number.empty()) << "Xvfb did not start";
    name_ = ":" + number;
  }
  ::Window find(const std::string& title) {
    ::Window root = 0, parent = 0, *children = nullptr;
    unsigned int count = 0;
    ::Window found = 0;
    XQueryTree(display_, DefaultRootWindow(display_), &root, &parent, &children, &count);
    for (unsigned int i = 0; i < count; ++i) {
      char* name = nullptr;
      if (XFetchName(display_, children[i], &name) != 0 && name != nullptr && title == name)
        found = children[i];
      if (name != nullptr) XFree(name);
    }
    if (children != nullptr) XFree(children);
    return found;
  }
  void send(long mask, XEvent& event) {
    XSendEvent(display_, handle_, True, mask, &event);
    XSync(display_, False);
  }

  pid_t server_ = -1;
  std::string name_;
};

TEST_F(Desktop, ShowsTheMainViewAndTheOthersOverIt) {
  open();
  for (const View view : kViews) EXPECT_EQ(content_.view(view).image.followers, 1) << "so that it is drawn";
  content_.view(View::kMain).image.publish(plain(0xE0, 0, 0));
  ASSERT_TRUE(turn_until([this] { return pixel(100, 600) == kBlue; })) << std::hex << pixel(100, 600);
  EXPECT_EQ(pixel(1200, 100), kBlue) << "no hit zone is shown";
  content_.view(View::kHit).image.publish(plain(0, 0, 0xE0));
  const cv::Rect2d hit = place_in_window(View::kHit, 1280, 720, 16.0 / 9);
  const int x = static_cast<int>(hit.x + hit.width / 2), y = static_cast<int>(hit.y + hit.height / 2);
  ASSERT_TRUE(turn_until([&] { return pixel(x, y) == 0xE00000; })) << std::hex << pixel(x, y);
  EXPECT_EQ(pixel(100, 600), kBlue);
  content_.view(View::kHit).image.clear();
  EXPECT_TRUE(turn_until([&] { return pixel(x, y) == kBlue; })) << "a zone that is over is taken away";
}

TEST_F(Desktop, KeysSteer) {
  open();
  for (const KeySym key : {XK_Left, XK_plus, XK_minus, XK_Home, XK_Tab, XK_Up}) press(key);
  ASSERT_TRUE(turn_until([this] { return requests_.size() >= 5; })) << requests_.size();
  EXPECT_EQ(requests_.front().view, View::kMain);
  EXPECT_LT(requests_.front().azimuth_rad, 0);
  EXPECT_EQ(requests_.back().view, View::kHit) << "Tab went on to it";
  EXPECT_GT(requests_.back().elevation_rad, 0);
  for (const KeySym key : {XK_t, XK_3, XK_a, XK_h, XK_Escape}) press(key);
  ASSERT_TRUE(turn_until([this] { return commands_.size() == 5; })) << commands_.size();
  EXPECT_EQ(commands_[0].value, 13);
  EXPECT_EQ(commands_[1].value, 3);
  EXPECT_EQ(commands_[2].value, 0);
  EXPECT_EQ(commands_[3].kind, CommandKind::kViewHold);
  EXPECT_EQ(commands_[3].value, 1);
  EXPECT_EQ(commands_[4].kind, CommandKind::kEmergencyStop);
  content_.switches.publish({true, true});
  commands_.clear();
  requests_.clear();
  press(XK_h);
  press(XK_r);
  ASSERT_TRUE(turn_until([this] { return commands_.size() == 1 && requests_.size() == 1; }));
  EXPECT_EQ(commands_[0].value, 0) << "released";
  EXPECT_EQ(requests_[0].record, false) << "ended";
}

// Over all views, without waiting for the next picture, and in alternating red while somebody has not
// confirmed.
// Tries synthetic_viewer: a stop that nobody confirms
TEST_F(Desktop, SaysWhoIsStoppedAndShoutsWhoIsNot) {
  open();
  content_.view(View::kMain).image.publish(plain(0xE0, 0, 0));
  ASSERT_TRUE(turn_until([this] { return pixel(3, 3) == kBlue; }));
  stops_.in_force = true;
  stops_.headline_words = {"stop_headline.stopped", {}};
  stops_.sides[0] = stops_.sides[1] = {SideView::Level::kStopped, "", {"stop_side.stopped_emergency", {}}};
  ASSERT_TRUE(turn_until([this] { return pixel(3, 3) != kBlue; }));
  const unsigned long calm = pixel(3, 3);
  for (int k = 0; k < 40; ++k) {
    window_->turn(0.02);
    ASSERT_EQ(pixel(3, 3), calm);
  }
  stops_.alarm = true;
  stops_.headline_words = {"stop_headline.not_confirmed", {}};
  stops_.sides[1] = {SideView::Level::kAlarm, "", {"stop_side.not_confirmed", {}}};
  EXPECT_TRUE(turn_until([&] { return pixel(3, 3) != calm; }));
  const unsigned long bright = pixel(3, 3);
  EXPECT_TRUE(turn_until([&] { return pixel(3, 3) == calm; }));
  EXPECT_TRUE(turn_until([&] { return pixel(3, 3) == bright; })) << "it goes on";
  stops_ = {};
  EXPECT_TRUE(turn_until([this] { return pixel(3, 3) == kBlue; }));
}

TEST_F(Desktop, DragAndWheelMoveTheViewUnderThePointer) {
  open();
  content_.view(View::kMain).image.publish(plain(0xE0, 0, 0));
  content_.view(View::kHit).image.publish(plain(0, 0, 0xE0));
  const cv::Rect2d hit = place_in_window(View::kHit, 1280, 720, 16.0 / 9);
  const int x = static_cast<int>(hit.x + 50), y = static_cast<int>(hit.y + 50);
  ASSERT_TRUE(turn_until([&] { return pixel(x, y) == 0xE00000; }));
  move_to(x, y);
  button(true, Button1, x, y);
  move_to(x + 20, y);
  button(false, Button1, x + 20, y);
  move_to(x + 40, y);  // not a drag any more
  ASSERT_TRUE(turn_until([this] { return !requests_.empty(); }));
  EXPECT_EQ(requests_.size(), 1U);
  EXPECT_EQ(requests_[0].view, View::kHit);
  EXPECT_NEAR(requests_[0].azimuth_rad, drag_request(View::kHit, 20, 0, hit.height).azimuth_rad, 1e-9);
  requests_.clear();
  move_to(100, 600);
  button(true, Button4, 100, 600);  // wheel, away from the user
  ASSERT_TRUE(turn_until([this] { return !requests_.empty(); }));
  EXPECT_EQ(requests_.back().view, View::kMain);
  EXPECT_LT(requests_.back().zoom, 1.0);
}

TEST_F(Desktop, ClosingItIsTold) {
  open();
  EXPECT_TRUE(window_->turn(0.02));
  XClientMessageEvent event{};
  event.type = ClientMessage;
  event.window = handle_;
  event.message_type = XInternAtom(display_, "WM_PROTOCOLS", False);
  event.format = 32;
  event.data.l[0] = static_cast<long>(XInternAtom(display_, "WM_DELETE_WINDOW", False));
  XSendEvent(display_, handle_, False, NoEventMask, reinterpret_cast<XEvent*>(&event));
  XSync(display_, False);
  bool open_still = true;
  for (int k = 0; k < 1000 && open_still; ++k) open_still = window_->turn(0.02);
  EXPECT_FALSE(open_still);
  window_.reset();
  for (const View view : kViews) EXPECT_EQ(content_.view(view).image.followers, 0);
}

// Tries synthetic_viewer: `--window` and no display
TEST(NoDesktop, IsSaidWithTheReason) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  PageContent content;
  try {
    Window window("nowhere", content, {}, {});
    FAIL() << "a window without a display";
  } catch (const core::MissingError& problem) {
    EXPECT_NE(std::string(problem.what()).find("no desktop to open a window on"), std::string::npos)
        << problem.what();
    EXPECT_NE(std::string(problem.what()).find("DISPLAY"), std::string::npos) << problem.what();
  }
}

}  // namespace
}  // namespace phantom::synthetic_viewer
