#include "components/synthetic_viewer/tests/web_driver.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>

namespace phantom::synthetic_viewer::test {
namespace {

using nlohmann::json;

constexpr const char* kDriver = "/usr/bin/chromedriver";
constexpr const char* kBrowser = "/usr/bin/chromium";
constexpr const char* kReady = "started successfully on port ";
constexpr int kMaxStarts = 3;
constexpr int kMaxOfScript_s =
    120;  // only bounds a failing test: software that draws on a loaded machine takes its time

}  // namespace

std::string from_base64(const std::string& text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t value =
        std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/").find(c);
    if (value == std::string_view::npos) continue;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> static_cast<unsigned>(count) & 0xFFU);
  }
  return bytes;
}

bool Browser::installed() { return std::filesystem::exists(kDriver) && std::filesystem::exists(kBrowser); }

Browser::Browser(const std::vector<std::string>& more) {
  std::string said;
  int port = 0;
  for (int tries = 0; port == 0 && tries < kMaxStarts; ++tries) port = start_driver(said);
  if (port == 0) throw std::runtime_error("chromedriver: " + said);
  client_.emplace("127.0.0.1", port);
  client_->set_read_timeout(2 * kMaxOfScript_s);
  json options{{"binary", kBrowser},
               {"args",
                {"--headless", "--no-sandbox", "--disable-quic", "--no-first-run",
                 "--disable-background-networking", "--disable-component-update", "--disable-sync",
                 "--disable-dev-shm-usage", "--window-size=1600,1300"}}};
  // Without a graphics card, unless the caller says what stands in for one.
  const auto is_graphics = [](const std::string& argument) { return argument.starts_with("--use-angle"); };
  if (std::none_of(more.begin(), more.end(), is_graphics)) options["args"].push_back("--disable-gpu");
  for (const std::string& argument : more) options["args"].push_back(argument);
  // A page counts as opened once its scripts have run: its pictures are streams, and one that waits for a
  // free connection would hold up the end of loading for ever.
  const json wanted{{"browserName", "chrome"},
                    {"pageLoadStrategy", "eager"},
                    {"timeouts", {{"script", kMaxOfScript_s * 1000}}},
                    {"goog:chromeOptions", options}};
  session_ = "/session/" + begin(wanted).at("sessionId").get<std::string>();
}

// The driver takes a port that is free for one version of IP, and gives up where the other one has it in use.
int Browser::start_driver(std::string& said) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) throw std::runtime_error("pipe");
  driver_ = fork();
  if (driver_ == 0) {
    setpgid(0, 0);  // so that the browser's processes go with it
    dup2(pipe_ends[1], STDOUT_FILENO);
    execl(kDriver, kDriver, "--port=0", static_cast<char*>(nullptr));
    _exit(127);
  }
  close(pipe_ends[1]);
  output_ = pipe_ends[0];
  said.clear();
  char piece[256];
  while (said.find(kReady) == std::string::npos || said.find('\n', said.find(kReady)) == std::string::npos) {
    const ssize_t size = read(output_, piece, sizeof piece);
    if (size <= 0) {
      waitpid(driver_, nullptr, 0);
      close(output_);
      return 0;
    }
    said.append(piece, static_cast<std::size_t>(size));
  }
  return std::atoi(said.c_str() + said.find(kReady) + std::string_view(kReady).size());
}

// On a machine under load a browser's start now and then fails; that says nothing about the page.
json Browser::begin(const json& wanted) {
  for (int tries = 1;; ++tries) {
    try {
      return post("/session", {{"capabilities", {{"alwaysMatch", wanted}}}});
    } catch (const std::runtime_error& problem) {
      if (tries == kMaxStarts) throw;
      std::cerr << "the browser did not start, once more: " << problem.what() << '\n';
    }
  }
}

Browser::~Browser() {
  if (!session_.empty()) client_->Delete(session_);
  kill(-driver_, SIGKILL);
  waitpid(driver_, nullptr, 0);
  close(output_);
}

json Browser::post(const std::string& path, const json& body) {
  const auto result = client_->Post(path, body.dump(), "application/json");
  if (!result) throw std::runtime_error(path + ": " + httplib::to_string(result.error()));
  const json answer = json::parse(result->body).at("value");
  if (result->status != 200) throw std::runtime_error(path + ": " + answer.dump());
  return answer;
}

void Browser::open(const std::string& url) { post(session_ + "/url", {{"url", url}}); }

std::string Browser::open_window(const std::string& url) {
  const std::string handle =
      post(session_ + "/window/new", {{"type", "window"}}).at("handle").get<std::string>();
  switch_to(handle);
  open(url);
  return handle;
}

std::string Browser::window() {
  const auto result = client_->Get(session_ + "/window");
  if (!result) throw std::runtime_error("window: " + httplib::to_string(result.error()));
  return json::parse(result->body).at("value").get<std::string>();
}

std::vector<std::string> Browser::windows() {
  const auto result = client_->Get(session_ + "/window/handles");
  if (!result) throw std::runtime_error("window handles: " + httplib::to_string(result.error()));
  return json::parse(result->body).at("value").get<std::vector<std::string>>();
}

void Browser::switch_to(const std::string& handle) { post(session_ + "/window", {{"handle", handle}}); }

void Browser::enter_frame(const std::string& selector) {
  post(session_ + "/frame", {{"id", element(selector)}});
}
void Browser::leave_frame() { post(session_ + "/frame", {{"id", nullptr}}); }

void Browser::click(const std::string& selector) {
  const json found = element(selector);
  post(session_ + "/element/" + found.begin()->get<std::string>() + "/click", json::object());
}

json Browser::run(const std::string& script) {
  return post(session_ + "/execute/sync", {{"script", script}, {"args", json::array()}});
}

json Browser::element(const std::string& selector) {
  return post(session_ + "/element", {{"using", "css selector"}, {"value", selector}});
}

void Browser::act(const json& actions) { post(session_ + "/actions", {{"actions", json::array({actions})}}); }

void Browser::type(const std::vector<std::string>& keys) {
  json steps = json::array();
  for (const std::string& key : keys) {
    steps.push_back({{"type", "keyDown"}, {"value", key}});
    steps.push_back({{"type", "keyUp"}, {"value", key}});
  }
  act({{"type", "key"}, {"id", "keys"}, {"actions", steps}});
}

void Browser::hover(const std::string& selector) {
  const json move_to{
      {"type", "pointerMove"}, {"origin", element(selector)}, {"x", 0}, {"y", 0}, {"duration", 0}};
  act({{"type", "pointer"}, {"id", "mouse"}, {"actions", json::array({move_to})}});
}

void Browser::drag(const std::string& selector, int dx, int dy) {
  const json move_to{
      {"type", "pointerMove"}, {"origin", element(selector)}, {"x", 0}, {"y", 0}, {"duration", 0}};
  const json move_by{{"type", "pointerMove"}, {"origin", "pointer"}, {"x", dx}, {"y", dy}, {"duration", 50}};
  act({{"type", "pointer"},
       {"id", "mouse"},
       {"actions",
        {move_to,
         {{"type", "pointerDown"}, {"button", 0}},
         move_by,
         {{"type", "pointerUp"}, {"button", 0}}}}});
}

void Browser::wheel(const std::string& selector, int delta_y) {
  const json scroll{{"type", "scroll"}, {"origin", element(selector)}, {"x", 0}, {"y", 0}, {"deltaX", 0},
                    {"deltaY", delta_y}};
  act({{"type", "wheel"}, {"id", "wheel"}, {"actions", json::array({scroll})}});
}

// Commands of Chromium's own protocol.
void Browser::send_command(const std::string& command, const json& parameters) {
  post(session_ + "/goog/cdp/execute", {{"cmd", command}, {"params", parameters}});
}

void Browser::show_on(int width_px, int height_px, bool touch) {
  send_command("Emulation.setDeviceMetricsOverride",
               {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", touch}});
  send_command("Emulation.setTouchEmulationEnabled", {{"enabled", touch}, {"maxTouchPoints", 2}});
}

void Browser::touch(const char* kind, const std::vector<std::array<double, 2>>& points) {
  json at = json::array();
  for (std::size_t i = 0; i < points.size(); ++i)
    at.push_back({{"x", points[i][0]}, {"y", points[i][1]}, {"id", i}});
  send_command("Input.dispatchTouchEvent", {{"type", kind}, {"touchPoints", at}});
}

std::string Browser::screenshot() {
  const auto result = client_->Get(session_ + "/screenshot");
  return result ? from_base64(json::parse(result->body).at("value").get<std::string>()) : std::string();
}

}  // namespace phantom::synthetic_viewer::test
