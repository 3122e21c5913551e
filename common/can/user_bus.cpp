#include "common/can/user_bus.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <vector>

#include "common/can/user_bus_wire.hpp"

namespace phantom::can {

bool is_user_address(const std::string& address) noexcept { return address.rfind("user:", 0) == 0; }

core::Expected<std::string> wire::name_in(const std::string& address) {
  std::string name = is_user_address(address) ? address.substr(sizeof "user:" - 1) : "";
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  });
  if (name.empty() || name.size() > 64 || !plain)
    return core::Status::invalid_argument(
        "bus address '" + address + "'; allowed: user:NAME with 1 to 64 letters, digits, '_', '-' or '.'");
  return name;
}

namespace {

using core::ErrorCode;
using core::Status;
using wire::Packet;

// Connects a socket to the process that serves the bus.
core::Expected<int> connect_to(const std::string& address) {
  const auto name = wire::name_in(address);
  if (!name) return name.status();
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) return Status{ErrorCode::kUnavailable, address + ": " + std::strerror(errno)};
  sockaddr_un where{};
  const socklen_t size = wire::address_of(*name, where);
  if (connect(socket, reinterpret_cast<const sockaddr*>(&where), size) != 0) {
    const int error = errno;
    close(socket);
    return Status::not_found(address + ": no process serves this bus (" + std::strerror(error) +
                             "); start one, e.g. simulated_drive --bus " + address);
  }
  return socket;
}

class UserBus final : public CanBus {
 public:
  UserBus(int socket, std::string address) : socket_(socket), address_(std::move(address)) {}
  ~UserBus() override { close(socket_); }
  UserBus(const UserBus&) = delete;
  UserBus& operator=(const UserBus&) = delete;

  SendResult send(const CanFrame& frame) noexcept override {
    if (!is_valid(frame)) return SendResult::kInvalid;
    if (state_ == BusState::kBusOff || state_ == BusState::kDown) {
      ++counters_.refused;
      return state_ == BusState::kBusOff ? SendResult::kBusOff : SendResult::kDown;
    }
    const Packet packet = wire::packet_of(frame);
    if (::send(socket_, &packet, sizeof packet, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof packet) {
      ++counters_.sent;
      return SendResult::kSent;
    }
    ++counters_.refused;
    return errno == EAGAIN || errno == ENOBUFS ? SendResult::kQueueFull : SendResult::kDown;
  }

  bool receive(Received& received) noexcept override {
    if (has_held_) {
      has_held_ = false;
      received = held_;
      count(received);
      return true;
    }
    constexpr int kMaxPassedOver = 4096;  // bounds the loop, however many frames the filters reject
    for (int i = 0; i < kMaxPassedOver; ++i) {
      Packet packet;
      const ssize_t size = recv(socket_, &packet, sizeof packet, MSG_DONTWAIT);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) return false;
      if (size <= 0) return report_down(received);
      if (size != sizeof packet) continue;
      if (!take(packet, received)) continue;
      count(received);
      return true;
    }
    return false;
  }

  bool wait(core::Nanoseconds timeout_ns) noexcept override {
    if (has_held_) return true;
    pollfd entry{socket_, POLLIN, 0};
    const timespec timeout{timeout_ns / core::kNsPerSecond, timeout_ns % core::kNsPerSecond};
    return ppoll(&entry, 1, &timeout, nullptr) > 0;
  }

  Status set_filters(std::span<const CanFilter> filters) override {
    filters_.assign(filters.begin(), filters.end());
    everything_ = false;
    return Status::ok();
  }

  Status restart() override {
    Packet packet;
    packet.kind = Packet::kRestart;
    if (::send(socket_, &packet, sizeof packet, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof packet)
      return Status::ok();
    // The process that served the bus is gone; another one may serve it now.
    const auto fresh = connect_to(address_);
    if (!fresh) return fresh.status();
    close(socket_);
    socket_ = *fresh;
    state_ = BusState::kActive;
    has_held_ = false;
    return Status::ok();
  }

  BusState state() const noexcept override { return state_; }
  const BusCounters& counters() const noexcept override { return counters_; }
  const std::string& address() const noexcept override { return address_; }

 private:
  void count(const Received& received) noexcept {
    ++(received.is_frame() ? counters_.received : counters_.errors);
    if (received.errors & kErrorBusOff) ++counters_.bus_offs;
  }

  bool take(const Packet& packet, Received& received) noexcept {
    received = {.frame = {}, .errors = packet.errors, .state = state_, .time_ns = packet.time_ns};
    if (packet.kind == Packet::kEvent) state_ = received.state = static_cast<BusState>(packet.state);
    if (packet.kind == Packet::kFrame) received.frame = wire::frame_of(packet);
    const bool wanted = packet.kind == Packet::kEvent || everything_ || passes(filters_, received.frame);
    if (packet.lost == 0) return wanted;
    counters_.lost += packet.lost;  // reported first; the packet's own content is kept for the next call
    has_held_ = wanted;
    held_ = received;
    received = {.frame = {}, .errors = kErrorOverflow, .state = state_, .time_ns = packet.time_ns};
    return true;
  }

  bool report_down(Received& received) noexcept {
    if (state_ == BusState::kDown) return false;
    state_ = BusState::kDown;
    ++counters_.errors;
    received = {.frame = {}, .errors = kErrorDown, .state = state_, .time_ns = core::monotonic_ns()};
    return true;
  }

  int socket_;
  std::string address_;
  std::vector<CanFilter> filters_;
  bool everything_ = true;
  bool has_held_ = false;
  Received held_;
  BusState state_ = BusState::kActive;
  BusCounters counters_;
};

}  // namespace

core::Expected<std::unique_ptr<CanBus>> open_user_bus(const std::string& address) {
  const auto socket = connect_to(address);
  if (!socket) return socket.status();
  return std::unique_ptr<CanBus>(std::make_unique<UserBus>(*socket, address));
}

}  // namespace phantom::can
