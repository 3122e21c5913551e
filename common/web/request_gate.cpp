#include "common/web/request_gate.hpp"

#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/core/errors.hpp"
#include "common/core/thread_config.hpp"
#include "common/web/request_origin.hpp"

namespace phantom::web {
namespace {

constexpr int kBacklog = 1024;     // connections that the kernel keeps for us
constexpr int kUrgentWorkers = 4;  // each occupied until both sides have confirmed the stop, or half a second
constexpr int kUrgentWaiting = 64;   // further ones ask for what has been asked for
constexpr int kAcceptedAtOnce = 64;  // before the others are read again

/// What a handler wants in place of its answer: RequestGate::switch_protocol().
struct Switching {
  std::string answer;
  std::function<void(Channel)> take;
};
// Handlers do not know the connection, but run on the thread that answers it.
thread_local std::optional<Switching> switching;

short awaited_after(Channel::Step step) { return step == Channel::Step::kWantsWrite ? POLLOUT : POLLIN; }

/// A request that has been received, as the library reads it, and the connection for its answer.
class ReceivedRequest final : public httplib::Stream {
 public:
  ReceivedRequest(Channel& channel, const std::string& text, std::chrono::milliseconds write_time)
      : channel_(channel), text_(text), write_time_(write_time) {}

  bool is_readable() const override { return at_ < text_.size(); }
  bool is_writable() const override { return Channel::wait_for(channel_.descriptor(), POLLOUT, write_time_); }
  ssize_t read(char* data, std::size_t size) override {
    const std::size_t taken = text_.copy(data, size, at_);
    at_ += taken;
    return static_cast<ssize_t>(taken);
  }
  ssize_t write(const char* data, std::size_t size) override {
    return switching ? static_cast<ssize_t>(size) : write_now(data, size);
  }
  ssize_t write_now(const char* data, std::size_t size) {
    // The time counts for all of it: whoever takes an octet now and then does not hold a worker.
    const auto until = std::chrono::steady_clock::now() + write_time_;
    for (std::string_view rest(data, size); !rest.empty();) {
      std::size_t sent = 0;
      const Channel::Step step = channel_.write(rest, sent);
      rest.remove_prefix(sent);
      if (step == Channel::Step::kDone) continue;
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      if (step == Channel::Step::kClosed || left.count() <= 0) return -1;
      if (!Channel::wait_for(channel_.descriptor(), awaited_after(step), left)) return -1;
    }
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    name(channel_.remote(), ip, port);
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override { name(channel_.local(), ip, port); }
  int socket() const override { return channel_.descriptor(); }

 private:
  static void name(const EndPoint& end, std::string& ip, int& port) {
    ip = end.address;
    port = end.port;
  }

  Channel& channel_;
  const std::string& text_;
  std::size_t at_ = 0;
  std::chrono::milliseconds write_time_;
};

}  // namespace

void RequestGate::Handlers::close_listener() {
  const int descriptor = svr_sock_.exchange(INVALID_SOCKET);
  if (descriptor != INVALID_SOCKET) close(descriptor);
}

bool RequestGate::Queue::put(Connection& connection, int most) {
  {
    const std::lock_guard lock(mutex_);
    const auto same = std::count_if(waiting_.begin(), waiting_.end(), [&](const Connection& other) {
      return other.address == connection.address;
    });
    if (std::ssize(waiting_) >= most || same >= (most + 1) / 2) return false;
    waiting_.push_back(std::move(connection));
  }
  changed_.notify_one();
  return true;
}

bool RequestGate::Queue::take(Connection& connection) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
  if (waiting_.empty()) return false;
  connection = std::move(waiting_.front());
  waiting_.pop_front();
  return true;
}

void RequestGate::Queue::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    waiting_.clear();
  }
  changed_.notify_all();
}

RequestGate::RequestGate(std::string name, const GateLimits& limits, IsUrgent is_urgent,
                         const TlsContext* tls)
    : progress_(std::move(name), kTurn_s, kHangsAfter_s),
      limits_(limits),
      is_urgent_(std::move(is_urgent)),
      tls_(tls) {
  // Replaces the library's default, which lets two servers share a port unnoticed.
  handlers_.set_socket_options([](int descriptor) {
    const int yes = 1;
    setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
}

void RequestGate::bind(const std::string& address, int wanted, const char* key) {
  port_ = wanted == 0                               ? handlers_.bind_to_any_port(address)
          : handlers_.bind_to_port(address, wanted) ? wanted
                                                    : -1;
  // Listening again widens the library's backlog of five connections.
  if (port_ > 0 && listen(handlers_.listener(), kBacklog) == 0) return;
  throw core::MissingError("the operator's page cannot be served on " + address + ":" +
                           std::to_string(wanted) +
                           ": the port is taken or the address is not this host's. Choose another " + key +
                           " (0: any free one) or page.address.");
}

void RequestGate::switch_protocol(std::string answer, std::function<void(Channel)> take) {
  switching.emplace(std::move(answer), std::move(take));
}

void RequestGate::start() {
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake_ < 0) throw core::MissingError("the operator's page cannot be served: no file descriptor is free");
  const auto in_thread = [this](core::ThreadRole role, auto work) {
    threads_.emplace_back([role, work] {
      core::apply_thread_config(role);
      work();
    });
  };
  in_thread(core::ThreadRole::kPageReader, [this] { read_connections(); });
  for (int i = 0; i < kUrgentWorkers; ++i) in_thread(core::ThreadRole::kPage, [this] { work(urgent_); });
  for (int i = 0; i < limits_.workers; ++i) in_thread(core::ThreadRole::kPage, [this] { work(ordinary_); });
}

void RequestGate::stop() {
  ending_ = true;
  if (wake_ >= 0) eventfd_write(wake_, 1);
  if (!threads_.empty()) threads_.front().join();
  handlers_.close_listener();
  for (Queue* queue : {&ordinary_, &urgent_}) queue->end();
  {
    const std::lock_guard lock(answered_mutex_);
    for (const int descriptor : answered_) shutdown(descriptor, SHUT_RDWR);
  }
  for (std::size_t i = 1; i < threads_.size(); ++i) threads_[i].join();
  threads_.clear();
  if (wake_ >= 0) close(std::exchange(wake_, -1));
}

void RequestGate::read_connections() {
  std::vector<pollfd> watched;
  progress_.begin();
  while (!ending_) {
    watched.assign({{wake_, POLLIN, 0}, {handlers_.listener(), POLLIN, 0}});
    for (const Connection& one : waiting_) watched.push_back({one.channel.descriptor(), one.awaited, 0});
    poll(watched.data(), watched.size(), static_cast<int>(1e3 * kTurn_s));
    progress_.tick();
    auto state = watched.begin() + 2;
    for (auto one = waiting_.begin(); one != waiting_.end(); ++state)
      one = state->revents != 0 && !receive(*one) ? waiting_.erase(one) : std::next(one);
    end_late(Clock::now());
    if (watched[1].revents != 0) accept_connections();
  }
  waiting_.clear();
  progress_.end();
}

void RequestGate::accept_connections() {
  for (int i = 0; i < kAcceptedAtOnce; ++i) {
    // The listener blocks, as the library has made it.
    if (!Channel::wait_for(handlers_.listener(), POLLIN, std::chrono::milliseconds(0))) return;
    const int descriptor = accept4(handlers_.listener(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) {
      // No descriptor is free, say: others end within the time for a request.
      if (errno == EMFILE || errno == ENFILE) std::this_thread::sleep_for(std::chrono::milliseconds(10));
      return;
    }
    const int yes = 1;
    setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    Channel channel(descriptor, tls_);
    std::string address = network_of(channel.remote().address);
    Connection connection{std::move(channel), std::move(address), {}, Clock::now(), POLLIN};
    if (!receive(connection)) continue;  // its request was there already: it needs no place
    make_room(connection.address);
    waiting_.push_back(std::move(connection));
  }
}

bool RequestGate::receive(Connection& connection) {
  const std::size_t most = limits_.request.head + limits_.request.body;
  std::array<char, 4096> octets;
  for (;;) {
    std::size_t got = 0;
    const Channel::Step step = connection.channel.read(octets.data(), octets.size(), got);
    if (step == Channel::Step::kClosed) return false;
    if (step == Channel::Step::kNoTls) {
      refuse(connection.channel, 400, "this port speaks https, with TLS 1.2 or 1.3");
      return false;
    }
    if (step != Channel::Step::kDone) {
      connection.awaited = awaited_after(step);
      return true;
    }
    connection.octets.append(octets.data(), got);
    if (!pass_on(connection)) return false;
    if (connection.octets.size() >= most) return true;  // cannot be: such a request is complete or refused
  }
}

bool RequestGate::pass_on(Connection& connection) {
  RequestFrame frame = frame_request(connection.octets, limits_.request);
  if (frame.state == RequestFrame::State::kIncomplete) return true;
  if (frame.state == RequestFrame::State::kRefused) {
    refuse(connection.channel, frame.status, frame.reason);
    return false;
  }
  const bool urgent = is_urgent_ && is_urgent_(frame);
  connection.octets = std::move(frame.text);
  const bool taken =
      urgent ? urgent_.put(connection, kUrgentWaiting) : ordinary_.put(connection, limits_.waiting);
  if (!taken) refuse(connection.channel, 503, "too many requests wait already");
  return false;
}

void RequestGate::make_room(const std::string& address) {
  std::map<std::string, int> counts;
  for (const Connection& connection : waiting_) ++counts[connection.address];
  std::string from = address;
  if (counts[address] < limits_.connections_per_address) {
    if (std::ssize(waiting_) < limits_.connections) return;
    from = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
             return a.second < b.second;
           })->first;
  }
  const auto oldest = std::find_if(waiting_.begin(), waiting_.end(),
                                   [&](const Connection& one) { return one.address == from; });
  if (oldest == waiting_.end()) return;
  refuse(oldest->channel, 503, "too many connections wait for their request");
  waiting_.erase(oldest);
}

void RequestGate::end_late(Clock::time_point now) {
  // The oldest come first.
  while (!waiting_.empty() && now - waiting_.front().opened > limits_.request_time) {
    refuse(waiting_.front().channel, 408, "the request did not come as a whole in time");
    waiting_.pop_front();
  }
}

void RequestGate::work(Queue& queue) {
  Connection connection;
  while (queue.take(connection)) {
    const int descriptor = connection.channel.descriptor();
    {
      const std::lock_guard lock(answered_mutex_);
      answered_.insert(descriptor);
    }
    if (!ending_) {
      ReceivedRequest request(connection.channel, connection.octets, limits_.write_time);
      switching.reset();
      handlers_.answer(request);
      if (switching) (void)request.write_now(switching->answer.data(), switching->answer.size());
    }
    {
      const std::lock_guard lock(answered_mutex_);
      answered_.erase(descriptor);
    }
    if (switching) {
      std::exchange(switching, std::nullopt)->take(std::move(connection.channel));
      continue;
    }
    connection.channel.end_writing();
    shutdown(descriptor, SHUT_RDWR);
    connection.channel.close();
  }
}

void RequestGate::refuse(Channel& channel, int status, const std::string& reason) {
  const std::string body = nlohmann::json{{"ok", false}, {"message", reason}}.dump();
  const std::string text = "HTTP/1.1 " + std::to_string(status) +
                           " Refused\r\nConnection: close\r\nContent-Type: application/json\r\n"
                           "Cache-Control: no-store\r\nContent-Length: " +
                           std::to_string(body.size()) + "\r\n\r\n" + body;
  std::size_t sent = 0;
  if (channel.ready()) channel.write(text, sent);
  channel.end_writing();
  // What has been received and not read would make the kernel discard the answer.
  std::array<char, 16384> rest;
  recv(channel.descriptor(), rest.data(), rest.size(), MSG_DONTWAIT);
  channel.close();
}

}  // namespace phantom::web
