#include "common/simulation/user_bus_hub.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "common/can/user_bus_wire.hpp"
#include "common/core/thread_config.hpp"

namespace phantom::simulation {

using can::wire::Packet;

core::Expected<std::unique_ptr<UserBusHub>> UserBusHub::serve(const std::string& address,
                                                              const BusModelOptions& options) {
  const auto name = can::wire::name_in(address);
  if (!name) return name.status();
  const int listener = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int waker = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  sockaddr_un where{};
  const socklen_t size = can::wire::address_of(*name, where);
  if (listener < 0 || waker < 0 || bind(listener, reinterpret_cast<const sockaddr*>(&where), size) != 0 ||
      listen(listener, 64) != 0) {
    const core::Status status{
        errno == EADDRINUSE ? core::ErrorCode::kFailedPrecondition : core::ErrorCode::kUnavailable,
        address + ": cannot be served: " + std::strerror(errno)};
    if (listener >= 0) close(listener);
    if (waker >= 0) close(waker);
    return status;
  }
  return std::unique_ptr<UserBusHub>(new UserBusHub(listener, waker, options));
}

UserBusHub::UserBusHub(int listener, int waker, const BusModelOptions& options)
    : listener_(listener), waker_(waker), model_(options), thread_([this] {
        core::apply_thread_config(core::ThreadRole::kCanBus, core::kServoPriority);
        run();
      }) {}

UserBusHub::~UserBusHub() {
  stop_ = true;
  wake();
  thread_.join();
  for (const Client& client : clients_) close(client.socket);
  close(listener_);
  close(waker_);
}

void UserBusHub::wake() const noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = write(waker_, &one, sizeof one);
}

std::size_t UserBusHub::node_count() const {
  const std::lock_guard lock(mutex_);
  return clients_.size();
}

void UserBusHub::set_faults(std::vector<FaultRule> rules) {
  const std::lock_guard lock(mutex_);
  model_.set_faults(std::move(rules));
}

void UserBusHub::set_bus_off(int pid) {
  const std::lock_guard lock(mutex_);
  for (const Client& client : clients_) {
    if (client.pid == pid) model_.set_bus_off(client.node, core::monotonic_ns());
  }
  wake();
}

void UserBusHub::set_plugged(int pid, bool plugged) {
  const std::lock_guard lock(mutex_);
  for (const Client& client : clients_) {
    if (client.pid == pid) model_.set_plugged(client.node, plugged);
  }
  wake();
}

void UserBusHub::accept_clients() {
  for (;;) {
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) return;
    ucred peer{};
    socklen_t size = sizeof peer;
    const bool known = getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
    if (!known || (peer.uid != geteuid() && peer.uid != 0)) {  // another user's process may not move drives
      close(socket);
      continue;
    }
    clients_.push_back({.socket = socket, .pid = peer.pid, .node = model_.attach()});
  }
}

// Reads the client's packets while the node's queue has room. Returns false if the client is gone. Packets
// without room wait in the socket; once the socket is full, the client's send fails.
bool UserBusHub::read_client(Client& client) {
  while (client.waiting && !model_.queue_is_full(client.node)) {
    Packet packet;
    const ssize_t size = recv(client.socket, &packet, sizeof packet, MSG_DONTWAIT);
    if (size < 0) {
      client.waiting = errno == EINTR;
      return errno == EAGAIN || errno == EINTR;
    }
    if (size == 0) return false;
    if (size != sizeof packet) continue;
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (packet.kind == Packet::kRestart) model_.restart(client.node, now_ns);
    if (packet.kind == Packet::kFrame) model_.submit(client.node, can::wire::frame_of(packet), now_ns);
  }
  return true;
}

void UserBusHub::deliver(BusModel::NodeId to, const can::Received& received) {
  const auto client =
      std::find_if(clients_.begin(), clients_.end(), [to](const Client& c) { return c.node == to; });
  if (client == clients_.end()) return;
  Packet packet = can::wire::packet_of(received.frame);
  packet.kind = received.is_frame() ? Packet::kFrame : Packet::kEvent;
  packet.errors = received.errors;
  packet.state = static_cast<std::uint8_t>(received.state);
  packet.lost = static_cast<std::uint32_t>(client->lost);
  packet.time_ns = received.time_ns;
  const bool sent = ::send(client->socket, &packet, sizeof packet, MSG_DONTWAIT | MSG_NOSIGNAL) > 0;
  client->lost = sent ? 0 : client->lost + 1;
}

// Each frame on the bus is a round of this loop, so that only sockets that poll() names are asked.
void UserBusHub::run() {
  std::vector<pollfd> entries{{listener_, POLLIN, POLLIN}, {waker_, POLLIN, 0}};
  while (!stop_) {
    core::Nanoseconds until_ns = 0;
    {
      const std::lock_guard lock(mutex_);
      for (std::size_t i = 2; i < entries.size(); ++i) clients_[i - 2].waiting |= entries[i].revents != 0;
      if (entries[0].revents != 0) accept_clients();
      for (std::size_t i = clients_.size(); i-- > 0;) {
        if (read_client(clients_[i])) continue;
        model_.detach(clients_[i].node);
        close(clients_[i].socket);
        clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
      }
      model_.advance(core::monotonic_ns(),
                     [this](BusModel::NodeId to, const can::Received& r) { deliver(to, r); });
      entries.resize(2);
      for (const Client& client : clients_) {
        const bool full = model_.queue_is_full(client.node);
        entries.push_back({full ? -1 : client.socket, POLLIN, 0});  // -1: poll() passes it over
      }
      until_ns = model_.next_event_ns();
    }
    const bool open_end = until_ns == std::numeric_limits<core::Nanoseconds>::max();
    const core::Nanoseconds wait_ns =
        open_end ? 0 : std::max<core::Nanoseconds>(0, until_ns - core::monotonic_ns());
    const timespec timeout{wait_ns / core::kNsPerSecond, wait_ns % core::kNsPerSecond};
    if (ppoll(entries.data(), entries.size(), open_end ? nullptr : &timeout, nullptr) < 0)
      for (pollfd& entry : entries) entry.revents = POLLIN;  // interrupted: ask all
    if (entries[1].revents == 0) continue;
    std::uint64_t woken = 0;
    [[maybe_unused]] const auto size = read(waker_, &woken, sizeof woken);
  }
}

}  // namespace phantom::simulation
