#include "components/master_io/devices/desk_input.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/input_device.hpp"
#include "components/master_io/devices/desk_decode.hpp"
#include "components/master_io/devices/spacenav.hpp"

namespace phantom::master_io {
namespace {

constexpr int kPoll_ms = 20;

/// A device file, or the terminal, whose settings are restored at the end.
class OpenDevice {
 public:
  OpenDevice(int fd, bool terminal) : fd_(fd), terminal_(terminal) {
    if (!terminal_) return;
    tcgetattr(fd_, &before_);
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    tcsetattr(fd_, TCSANOW, &raw);
  }
  ~OpenDevice() {
    if (terminal_) tcsetattr(fd_, TCSANOW, &before_);
    if (!terminal_) close(fd_);
  }
  OpenDevice(const OpenDevice&) = delete;
  OpenDevice& operator=(const OpenDevice&) = delete;
  int fd() const { return fd_; }
  bool terminal() const { return terminal_; }

 private:
  int fd_;
  bool terminal_;
  termios before_{};
};

bool has_stick(int fd) {
  const auto axes = runtime::input_codes<ABS_CNT>(fd, EV_ABS);
  const auto keys = runtime::input_codes<KEY_CNT>(fd, EV_KEY);
  return axes[ABS_X] && axes[ABS_Y] && (keys[BTN_GAMEPAD] || keys[BTN_JOYSTICK] || keys[BTN_TRIGGER]);
}

bool has_six_axes(int fd) {
  const auto absolute = runtime::input_codes<ABS_CNT>(fd, EV_ABS);
  const auto relative = runtime::input_codes<REL_CNT>(fd, EV_REL);
  const auto keys = runtime::input_codes<KEY_CNT>(fd, EV_KEY);
  const auto six = [](const auto& axes) {
    return axes[ABS_X] && axes[ABS_Y] && axes[ABS_Z] && axes[ABS_RX] && axes[ABS_RY] && axes[ABS_RZ];
  };
  return (six(absolute) || six(relative)) && keys[BTN_0] && !keys[BTN_GAMEPAD];
}

std::string name_of_device(int fd, const std::string& path) {
  const std::string name = runtime::input_name(fd);
  return name.empty() ? path : name + " (" + path + ")";
}

int open_device(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return fd >= 0 ? fd : open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);  // read-only: no rumble
}

/// Opens the first gamepad or joystick, or the first space mouse, and returns its descriptor; −1: none.
int find_input(bool space_mouse, std::string& path) {
  for (const std::string& file : runtime::input_files()) {
    const int fd = open_device(file);
    if (fd < 0) continue;
    if (space_mouse ? has_six_axes(fd) : has_stick(fd)) {
      path = file;
      return fd;
    }
    close(fd);
  }
  return -1;
}

constexpr const char* kSpacenavd = "spacenavd";

/// Connects to spacenavd if the configuration names it, or leaves the choice of a space mouse: a daemon that
/// runs keeps its mouse to itself. Throws ConfigError and MissingError.
std::unique_ptr<Spacenav> open_spacenav(const DeskConfig& config) {
  const bool named = config.device == kSpacenavd;
  if (!config.space_mouse || (!named && config.device != "auto")) return nullptr;
  if (named && !Spacenav::built_in())
    throw core::ConfigError(
        "desk.device: spacenavd: this build lacks libspnav; allowed: auto, or a file of /dev/input");
  auto spacenav = Spacenav::connect();
  if (named && !spacenav)
    throw core::MissingError(
        "desk.device: spacenavd: no process serves its socket ($SPNAV_SOCKET, /etc/spnavrc, "
        "/var/run/spnav.sock); allowed: start it, or name a file of /dev/input");
  return spacenav;
}

/// Opens the configured device and returns its descriptor and path; for a terminal, the standard input.
int open_wanted(const DeskConfig& config, std::string& path) {
  const std::string& wanted = config.device;
  if (wanted == "terminal") {
    if (isatty(STDIN_FILENO) == 0)
      throw core::MissingError(
          "desk.device: terminal: the standard input is no terminal; start master_io in one");
    return STDIN_FILENO;
  }
  path = wanted;
  const int fd = wanted == "auto" ? find_input(config.space_mouse, path) : open_device(wanted);
  if (fd < 0) {
    throw core::MissingError(
        wanted == "auto" ? std::string("desk.device: auto: no ") +
                               (config.space_mouse ? "space mouse" : "gamepad or joystick") +
                               " in /dev/input that may be read; allowed: plug one in, or name its file" +
                               (config.space_mouse ? "" : ", or 'terminal' for keys")
                         : "desk.device: " + wanted + ": " + std::strerror(errno));
  }
  return fd;
}

std::unique_ptr<OpenDevice> open_desk(const DeskConfig& config, std::string& name) {
  std::string path;
  const int fd = open_wanted(config, path);
  if (fd == STDIN_FILENO) {
    name = "the keys of this terminal";
    return std::make_unique<OpenDevice>(fd, true);
  }
  name = name_of_device(fd, path);
  return std::make_unique<OpenDevice>(fd, false);
}

/// Drives the device's own rumble motors through the kernel's force feedback.
class Rumble {
 public:
  explicit Rumble(int fd) : fd_(fd) {
    effect_.type = FF_RUMBLE;
    effect_.id = -1;
    effect_.replay.length = 200;  // ms; if the process dies, the device does not go on shaking
    able_ = ioctl(fd_, EVIOCSFF, &effect_) >= 0;
  }
  bool able() const { return able_; }
  void play(double strength) {
    if (!able_) return;
    effect_.u.rumble.strong_magnitude = static_cast<std::uint16_t>(std::clamp(strength, 0.0, 1.0) * 65535.0);
    if (ioctl(fd_, EVIOCSFF, &effect_) < 0) return;
    input_event start{};
    start.type = EV_FF;
    start.code = static_cast<std::uint16_t>(effect_.id);
    start.value = 1;
    [[maybe_unused]] const auto written = write(fd_, &start, sizeof start);
  }

 private:
  int fd_;
  ff_effect effect_{};
  bool able_ = false;
};

AxisRanges ranges_of(int fd) {
  AxisRanges ranges;
  for (unsigned code = 0; code < ABS_CNT; ++code) {
    input_absinfo info{};
    if (ioctl(fd, EVIOCGABS(code), &info) >= 0 && info.maximum > info.minimum)
      ranges[code] = {info.minimum, info.maximum};
  }
  return ranges;
}

}  // namespace

void check_device(const DeskConfig& config) {
  if (open_spacenav(config)) return;
  std::string path;
  const int fd = open_wanted(config, path);
  if (fd != STDIN_FILENO) close(fd);
}

struct ManualInput::Impl {
  Impl(const DeskConfig& config, core::Snapshot<DeskState>& into, Listener listens, int servo_priority)
      : state(into), listener(std::move(listens)), spacenav(open_spacenav(config)) {
    if (spacenav) {
      name = kSpacenavd;
    } else {
      device = open_desk(config, name);
    }
    thread =
        std::jthread([this, servo_priority, space_mouse = config.space_mouse](const std::stop_token& stop) {
          core::apply_thread_config(core::ThreadRole::kDesk, servo_priority);
          progress.begin();
          if (spacenav) {
            read_spacenav(stop);
          } else if (device->terminal()) {
            read_terminal(stop);
          } else if (space_mouse) {
            SpaceMouseDecoder decoder(ranges_of(device->fd()));
            read_events(stop, decoder);
          } else {
            InputDecoder decoder(ranges_of(device->fd()),
                                 runtime::input_codes<ABS_CNT>(device->fd(), EV_ABS)[ABS_RX]);
            read_events(stop, decoder);
          }
          progress.end();
        });
  }

  void report(const DeskState& now, const DeskEvents& events) {
    progress.tick();
    for (; handled.stops != events.stops; ++handled.stops) listener.on_stop();
    for (; handled.resets != events.resets; ++handled.resets) listener.on_reset();
    for (; handled.opens != events.opens; ++handled.opens) listener.on_gripper(true);
    for (; handled.closes != events.closes; ++handled.closes) listener.on_gripper(false);
    for (std::size_t k = 0; k < kPerceptKeys; ++k)
      for (; handled.percepts[k] != events.percepts[k]; ++handled.percepts[k])
        listener.on_percepts(static_cast<PerceptKey>(k));
    state.write(now);
  }

  bool ready() const {
    pollfd wait{device->fd(), POLLIN, 0};
    return poll(&wait, 1, kPoll_ms) > 0;
  }

  template <class Decoder>
  void read_events(const std::stop_token& stop, Decoder& decoder) {
    Rumble rumble(device->fd());
    listener.notice(rumble.able() ? "drag and feedback are felt as rumble" : "the device cannot rumble");
    while (!stop.stop_requested()) {
      const bool any = ready();
      const double now_s = core::seconds(core::monotonic_ns());
      if (any) {
        input_event events[64];
        const auto bytes = read(device->fd(), events, sizeof events);
        if (bytes == 0 || (bytes < 0 && errno != EAGAIN && errno != EINTR)) break;  // unplugged
        for (std::size_t i = 0; bytes > 0 && i < static_cast<std::size_t>(bytes) / sizeof events[0]; ++i)
          decoder.take(events[i], now_s);
      }
      decoder.release_expired(now_s);
      report(decoder.state(), decoder.events());
      rumble.play(strength.load(std::memory_order_relaxed));
    }
    decoder.state() = {};  // alive = false
    report(decoder.state(), decoder.events());
    if (!stop.stop_requested()) listener.notice("device removed: nothing is pushed");
  }

  // The daemon may end and come back; meanwhile the device counts as gone.
  void read_spacenav(const std::stop_token& stop) {
    constexpr double kRetry_s = 2.0;
    SpacenavDecoder decoder;
    double retry_s = 0.0;
    while (!stop.stop_requested()) {
      const double now_s = core::seconds(core::monotonic_ns());
      if (!spacenav && now_s >= retry_s) {
        retry_s = now_s + kRetry_s;
        spacenav = Spacenav::connect();
        if (spacenav) listener.notice("spacenavd is back");
      }
      if (!spacenav) {
        std::this_thread::sleep_for(std::chrono::milliseconds(kPoll_ms));
        report({}, decoder.events());
        continue;
      }
      const bool lives = spacenav->read(kPoll_ms, now_s, decoder);
      decoder.release_expired(core::seconds(core::monotonic_ns()));
      report(lives ? decoder.state() : DeskState{}, decoder.events());
      if (lives) continue;
      spacenav.reset();
      decoder.lose();
      listener.notice("spacenavd is gone: nothing is pushed until it is back");
    }
    state.write({});
  }

  void read_terminal(const std::stop_token& stop) {
    TerminalDecoder decoder;
    while (!stop.stop_requested()) {
      char bytes[64];
      const auto now_s = core::seconds(core::monotonic_ns());
      if (ready()) {
        const auto count = read(device->fd(), bytes, sizeof bytes);
        if (count > 0) decoder.take({bytes, static_cast<std::size_t>(count)}, now_s);
      }
      decoder.release_expired(now_s);
      report(decoder.state(), decoder.events());
    }
    state.write({});
  }

  core::Snapshot<DeskState>& state;
  Listener listener;
  std::string name;
  std::unique_ptr<Spacenav> spacenav;
  std::unique_ptr<OpenDevice> device;  // where it is not spacenavd
  std::atomic<double> strength{0.0};
  DeskEvents handled;
  core::Progress progress{"desk"};
  std::jthread thread;
};

ManualInput::ManualInput(const DeskConfig& config, core::Snapshot<DeskState>& state, Listener listener,
                         int servo_priority)
    : impl_(std::make_unique<Impl>(config, state, std::move(listener), servo_priority)) {}
ManualInput::~ManualInput() = default;
void ManualInput::rumble(double strength) { impl_->strength.store(strength, std::memory_order_relaxed); }
const core::Progress& ManualInput::progress() const { return impl_->progress; }
const std::string& ManualInput::name() const { return impl_->name; }

}  // namespace phantom::master_io
