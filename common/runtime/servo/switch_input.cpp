#include "common/runtime/servo/switch_input.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <thread>

#include "common/core/errors.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/input_device.hpp"

namespace phantom::runtime {
namespace {

constexpr int kWait_ms = 10;  // a small part of the shortest staleness
constexpr core::Nanoseconds kLookAgain_ns = core::kNsPerSecond / 2;

bool has_keys(int fd, const SwitchKeys& keys) {
  const auto codes = input_codes<KEY_CNT>(fd, EV_KEY);
  const auto has = [&codes](int key) { return key < 0 || codes[static_cast<std::size_t>(key)]; };
  return has(keys.key) && has(keys.through_key);
}

int open_switch(const SwitchKeys& keys, std::string& name) {
  const bool is_file = keys.device.starts_with('/');
  name = keys.device + ": no such device with that key in /dev/input that may be read";
  for (const std::string& file : is_file ? std::vector{keys.device} : input_files()) {
    const int fd = open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
      if (is_file) name = file + ": " + std::strerror(errno);
      continue;
    }
    const bool wanted = is_file || keys.device == "auto" || input_name(fd) == keys.device;
    if (wanted && has_keys(fd, keys)) {
      name = input_name(fd) + " (" + file + ")";
      return fd;
    }
    if (is_file) name = file + ": has no such key";
    close(fd);
  }
  return -1;
}

int is_key_down(int fd, int key) {
  std::array<unsigned char, (KEY_CNT + 7) / 8> bytes{};
  if (ioctl(fd, EVIOCGKEY(bytes.size()), bytes.data()) < 0) return -1;
  return bytes[static_cast<std::size_t>(key) / 8] >> (key % 8) & 1;
}

}  // namespace

// ---- decoding

void SwitchDecoder::set_key(bool down) noexcept {
  if (reading_.contacts.first && !down) ++reading_.let_go;
  reading_.contacts.first = reading_.contacts.second = down;
}

bool SwitchDecoder::take(const input_event& event) noexcept {
  if (event.type == EV_SYN && event.code == SYN_DROPPED) lost_ = true;
  if (lost_) {
    if (event.type != EV_SYN || event.code != SYN_REPORT) return false;
    lost_ = false;
    return true;
  }
  if (event.type != EV_KEY || event.value > 1) return false;  // 2: key repetition
  if (event.code == keys_.key) set_key(event.value == 1);
  if (event.code == keys_.through_key) reading_.contacts.through = event.value == 1;
  return false;
}

void SwitchDecoder::set(bool key, bool through_key) noexcept {
  set_key(key);
  reading_.contacts.through = through_key;
  reading_.contacts.read = true;
}

// ---- the device

SwitchDevice::Kernel SwitchDevice::real() { return {open_switch, is_key_down}; }

SwitchDevice::SwitchDevice(const SwitchKeys& keys, Kernel kernel)
    : keys_(keys), kernel_(std::move(kernel)), decoder_(keys) {
  look_for();
}
SwitchDevice::~SwitchDevice() { close_device(); }

void SwitchDevice::look_for() {
  looked_ns_ = core::monotonic_ns();
  fd_ = kernel_.open(keys_, name_);
  if (fd_ >= 0 && !read_state()) close_device();
}

void SwitchDevice::close_device() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
  decoder_.unplug();
}

bool SwitchDevice::read_state() {
  const int key = kernel_.is_down(fd_, keys_.key);
  const int through = keys_.through_key < 0 ? 0 : kernel_.is_down(fd_, keys_.through_key);
  if (key < 0 || through < 0) return false;
  decoder_.set(key == 1, through == 1);
  return true;
}

// Returns false if the device is gone.
bool SwitchDevice::take_events() {
  std::array<input_event, 64> events{};
  bool read_anew = false;
  for (;;) {
    const auto bytes = read(fd_, events.data(), sizeof events);
    if (bytes < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (bytes <= 0) return false;  // unplugged
    for (std::size_t i = 0; i < static_cast<std::size_t>(bytes) / sizeof events[0]; ++i)
      read_anew = decoder_.take(events[i]) || read_anew;
  }
  return !read_anew || read_state();
}

SwitchReading SwitchDevice::wait(int timeout_ms) {
  if (fd_ < 0 && core::monotonic_ns() - looked_ns_ >= kLookAgain_ns) look_for();
  pollfd wait{fd_, POLLIN, 0};  // poll() passes over a descriptor of −1
  const bool any = poll(&wait, 1, timeout_ms) > 0;
  if (fd_ >= 0 && !(any ? take_events() : read_state())) close_device();
  SwitchReading reading = decoder_.reading();
  reading.at_ns = core::monotonic_ns();
  return reading;
}

void check_switch(const std::optional<EnablingSwitchConfig>& config) {
  if (!config || config->source != EnablingSwitchConfig::Source::kInput) return;
  const SwitchDevice device(config->keys);
  if (!device.plugged_in())
    throw core::MissingError("enabling_switch.device: " + device.name() +
                             "; allowed: plug it in, or name another device or key");
}

// ---- its thread

struct SwitchInput::Impl {
  Impl(const SwitchKeys& keys, core::Snapshot<SwitchReading>& into, int servo_priority) {
    thread = std::jthread([this, keys, &into, servo_priority](const std::stop_token& stop) {
      core::apply_thread_config(core::ThreadRole::kSwitch, servo_priority);
      progress.begin();
      run(keys, into, stop);
      progress.end();
    });
  }
  void run(const SwitchKeys& keys, core::Snapshot<SwitchReading>& into, const std::stop_token& stop) {
    SwitchDevice device(keys);
    bool logged = false, was_there = false;
    while (!stop.stop_requested()) {
      if (!logged || device.plugged_in() != was_there) {
        was_there = device.plugged_in();
        spdlog::log(was_there ? spdlog::level::info : spdlog::level::warn, "enabling switch: {}",
                    was_there ? device.name() : "not there: " + device.name());
        logged = true;
      }
      into.write(device.wait(kWait_ms));
      progress.tick();
    }
    into.write({});
  }

  core::Progress progress{"switch"};
  std::jthread thread;
};

std::unique_ptr<SwitchInput> SwitchInput::make(const std::optional<EnablingSwitchConfig>& config,
                                               SwitchReader& reader, int servo_priority) {
  if (!config) return nullptr;
  using Source = EnablingSwitchConfig::Source;
  spdlog::info("enabling switch fitted{}: the arm follows only while it is held",
               config->source == Source::kDrive       ? ", on a drive's digital inputs"
               : config->source == Source::kSimulated ? ", SIMULATED"
                                                      : "");
  return config->source == Source::kInput
             ? std::make_unique<SwitchInput>(config->keys, reader.input, servo_priority)
             : nullptr;
}

SwitchInput::SwitchInput(const SwitchKeys& keys, core::Snapshot<SwitchReading>& into, int servo_priority)
    : impl_(std::make_unique<Impl>(keys, into, servo_priority)) {}
SwitchInput::~SwitchInput() = default;
const core::Progress& SwitchInput::progress() const { return impl_->progress; }

}  // namespace phantom::runtime
