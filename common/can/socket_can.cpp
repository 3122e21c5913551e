#include "common/can/socket_can.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

namespace phantom::can {
namespace {

using core::ErrorCode;
using core::Status;

Status failure(const std::string& where, const std::string& what) {
  return {ErrorCode::kUnavailable, where + ": " + what + ": " + std::strerror(errno)};
}

ifreq request_for(const std::string& interface) {
  ifreq request{};
  std::strncpy(request.ifr_name, interface.c_str(), IFNAMSIZ - 1);
  return request;
}

std::uint16_t errors_of_controller(std::uint8_t detail, BusState& state) noexcept {
  std::uint16_t errors = 0;
  if (detail & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) errors |= kErrorOverflow;
  const BusState before = state;
  if (detail & CAN_ERR_CRTL_ACTIVE) state = BusState::kActive;
  if (detail & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) state = BusState::kWarning;
  if (detail & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) state = BusState::kPassive;
  if (state != before || errors == 0) errors |= kErrorState;
  return errors;
}

// Translates an error message frame of the kernel (linux/can/error.h).
std::uint16_t errors_of(const can_frame& raw, BusState& state) noexcept {
  std::uint16_t errors = 0;
  if (raw.can_id & CAN_ERR_TX_TIMEOUT) errors |= kErrorTransmitTimeout;
  if (raw.can_id & CAN_ERR_LOSTARB) errors |= kErrorArbitrationLost;
  if (raw.can_id & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) errors |= kErrorProtocol;
  if (raw.can_id & CAN_ERR_TRX) errors |= kErrorTransceiver;
  if (raw.can_id & CAN_ERR_ACK) errors |= kErrorNoAck;
  if (raw.can_id & CAN_ERR_CRTL) errors |= errors_of_controller(raw.data[1], state);
  if (raw.can_id & CAN_ERR_RESTARTED) {
    errors |= kErrorRestarted;
    state = BusState::kActive;
  }
  if (raw.can_id & CAN_ERR_BUSOFF) {
    errors |= kErrorBusOff;
    state = BusState::kBusOff;
  }
  return errors != 0 ? errors : static_cast<std::uint16_t>(kErrorProtocol);
}

class SocketCan final : public CanBus {
 public:
  SocketCan(int socket, std::string interface) : socket_(socket), interface_(std::move(interface)) {}
  ~SocketCan() override { close(socket_); }
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  SendResult send(const CanFrame& frame) noexcept override;
  bool receive(Received& received) noexcept override;
  bool wait(core::Nanoseconds timeout_ns) noexcept override;
  Status set_filters(std::span<const CanFilter> filters) override;
  Status restart() override;
  BusState state() const noexcept override { return state_; }
  const BusCounters& counters() const noexcept override { return counters_; }
  const std::string& address() const noexcept override { return interface_; }

 private:
  bool report(std::uint16_t errors, Received& received) noexcept;
  void read_control(msghdr& message, core::Nanoseconds& time_ns) noexcept;
  core::Nanoseconds monotonic_of(const timespec& stamp) noexcept;

  int socket_;
  std::string interface_;
  BusState state_ = BusState::kActive;
  BusCounters counters_;
  core::Nanoseconds newest_ns_ = 0;
  std::uint32_t overflows_ = 0;  // running count of the kernel
  bool overflow_to_report_ = false, down_to_report_ = false;
};

SendResult SocketCan::send(const CanFrame& frame) noexcept {
  if (!is_valid(frame)) return SendResult::kInvalid;
  if (state_ == BusState::kBusOff) {  // write() would still succeed, but the frame would be lost
    ++counters_.refused;
    return SendResult::kBusOff;
  }
  can_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  raw.can_dlc = frame.length;
  if (!frame.remote) std::copy_n(frame.data.begin(), frame.length, raw.data);
  if (write(socket_, &raw, sizeof raw) == static_cast<ssize_t>(sizeof raw)) {
    ++counters_.sent;
    return SendResult::kSent;
  }
  ++counters_.refused;
  if (errno == ENOBUFS || errno == EAGAIN) return SendResult::kQueueFull;
  down_to_report_ =
      down_to_report_ || state_ != BusState::kDown;  // the socket reports it once, here or in receive()
  return SendResult::kDown;
}

bool SocketCan::report(std::uint16_t errors, Received& received) noexcept {
  ++counters_.errors;
  if (errors & kErrorBusOff) ++counters_.bus_offs;
  newest_ns_ = std::max(newest_ns_, core::monotonic_ns());
  received = {.frame = {}, .errors = errors, .state = state_, .time_ns = newest_ns_};
  return true;
}

// Converts the kernel's CLOCK_REALTIME stamp to monotonic time by its age, with both clocks read together.
// The age is bounded, because the wall clock may be set in between.
core::Nanoseconds SocketCan::monotonic_of(const timespec& stamp) noexcept {
  const core::Nanoseconds stamped_ns = stamp.tv_sec * core::kNsPerSecond + stamp.tv_nsec;
  const core::Nanoseconds age_ns = core::utc_ns() - stamped_ns;
  return core::monotonic_ns() - std::max<core::Nanoseconds>(0, age_ns);
}

void SocketCan::read_control(msghdr& message, core::Nanoseconds& time_ns) noexcept {
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      time_ns = monotonic_of(stamp);
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t count = 0;
      std::memcpy(&count, CMSG_DATA(c), sizeof count);
      counters_.lost += count - overflows_;
      overflow_to_report_ = overflow_to_report_ || count != overflows_;
      overflows_ = count;
    }
  }
}

bool SocketCan::receive(Received& received) noexcept {
  if (down_to_report_) {
    down_to_report_ = false;
    state_ = BusState::kDown;
    return report(kErrorDown, received);
  }
  if (overflow_to_report_) {
    overflow_to_report_ = false;
    return report(kErrorOverflow, received);
  }
  can_frame raw{};
  iovec vector{&raw, sizeof raw};
  alignas(cmsghdr) char control[128];
  msghdr message{};
  message.msg_iov = &vector;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  const ssize_t size = recvmsg(socket_, &message, MSG_DONTWAIT);
  if (size < 0) {
    if (errno == EAGAIN || errno == EINTR || state_ == BusState::kDown) return false;
    state_ = BusState::kDown;  // ENETDOWN, ENODEV, ENXIO
    return report(kErrorDown, received);
  }
  if (size < static_cast<ssize_t>(sizeof raw)) return false;
  core::Nanoseconds time_ns = core::monotonic_ns();
  read_control(message, time_ns);
  if (raw.can_id & CAN_ERR_FLAG) return report(errors_of(raw, state_), received);
  if (state_ == BusState::kDown || state_ == BusState::kBusOff) state_ = BusState::kActive;
  newest_ns_ = std::max(newest_ns_, time_ns);
  received = {};
  received.time_ns = newest_ns_;
  received.state = state_;
  CanFrame& frame = received.frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.length = std::min<std::uint8_t>(raw.can_dlc, 8);
  if (!frame.remote) std::copy_n(raw.data, frame.length, frame.data.begin());
  ++counters_.received;
  return true;
}

bool SocketCan::wait(core::Nanoseconds timeout_ns) noexcept {
  if (overflow_to_report_ || down_to_report_) return true;
  pollfd entry{socket_, POLLIN, 0};
  const timespec timeout{timeout_ns / core::kNsPerSecond, timeout_ns % core::kNsPerSecond};
  return ppoll(&entry, 1, &timeout, nullptr) > 0;
}

Status SocketCan::set_filters(std::span<const CanFilter> filters) {
  std::vector<can_filter> raw;
  for (const CanFilter& f : filters) {
    const canid_t format = f.extended ? CAN_EFF_FLAG : 0U;
    raw.push_back({(f.id & f.mask) | format, f.mask | CAN_EFF_FLAG});
  }
  if (raw.size() > CAN_RAW_FILTER_MAX)
    return Status::invalid_argument(interface_ + ": " + std::to_string(raw.size()) +
                                    " filters; allowed: at most " + std::to_string(CAN_RAW_FILTER_MAX));
  const auto bytes = static_cast<socklen_t>(raw.size() * sizeof(can_filter));
  if (setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, raw.data(), bytes) != 0)
    return failure(interface_, "cannot set filters");
  return Status::ok();
}

Status SocketCan::restart() {
  ifreq request = request_for(interface_);
  if (ioctl(socket_, SIOCGIFFLAGS, &request) != 0) return failure(interface_, "is gone");
  for (const bool up : {false, true}) {
    request.ifr_flags = static_cast<short>(up ? request.ifr_flags | IFF_UP : request.ifr_flags & ~IFF_UP);
    if (ioctl(socket_, SIOCSIFFLAGS, &request) != 0)
      return failure(interface_, std::string("cannot be taken ") + (up ? "up" : "down") + " for a restart");
  }
  // Taking the interface down left a pending error on the socket; it is discarded.
  int pending = 0;
  socklen_t size = sizeof pending;
  getsockopt(socket_, SOL_SOCKET, SO_ERROR, &pending, &size);
  down_to_report_ = false;
  state_ = BusState::kActive;
  return Status::ok();
}

Status prepare(int socket, const std::string& interface) {
  ifreq request = request_for(interface);
  if (ioctl(socket, SIOCGIFINDEX, &request) != 0)
    return Status::not_found(interface +
                             ": no such network interface; allowed: a SocketCAN interface, or "
                             "user:NAME for a userspace bus");
  const int index = request.ifr_ifindex;
  if (ioctl(socket, SIOCGIFHWADDR, &request) != 0 || request.ifr_hwaddr.sa_family != ARPHRD_CAN)
    return Status::invalid_argument(interface + ": is not a CAN interface");
  if (ioctl(socket, SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_UP) == 0)
    return Status::not_found(interface + ": is down; bring it up: ip link set " + interface +
                             " up type can bitrate 1000000 restart-ms 100");
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  const int on = 1;
  const int buffer_bytes = 1 << 20;
  setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
  if (setsockopt(socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors, sizeof all_errors) != 0 ||
      setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      setsockopt(socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0)
    return failure(interface, "cannot be configured");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return failure(interface, "cannot be bound");
  return Status::ok();
}

}  // namespace

core::Expected<std::unique_ptr<CanBus>> open_socket_can(const std::string& interface) {
  if (interface.empty() || interface.size() >= IFNAMSIZ)
    return Status::invalid_argument("CAN address '" + interface +
                                    "'; allowed: an interface name of 1 to 15 characters, or user:NAME");
  const int socket = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket < 0)
    return Status::not_found(interface + ": this kernel has no CAN (modules can and can-raw): " +
                             std::strerror(errno) + "; a userspace bus needs none: user:NAME");
  const Status prepared = prepare(socket, interface);
  if (!prepared) {
    close(socket);
    return prepared;
  }
  return std::unique_ptr<CanBus>(std::make_unique<SocketCan>(socket, interface));
}

}  // namespace phantom::can
