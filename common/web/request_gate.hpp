#pragma once

#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/core/progress.hpp"
#include "common/web/channel.hpp"
#include "common/web/http_handlers.hpp"
#include "common/web/request_frame.hpp"

namespace phantom::web {

struct GateLimits {
  int connections = 64;              ///< connections whose request has not come yet
  int connections_per_address = 32;  ///< of these, from one address (IPv6: one /64 network)
  int workers = 16;                  ///< requests that are answered at once, besides the urgent ones
  int waiting = 64;                  ///< requests that wait for a worker
  RequestLimits request;
  std::chrono::milliseconds request_time{3000};  ///< for a whole request to come
  std::chrono::milliseconds write_time{2000};    ///< for a part of an answer to be taken
};

/// A TCP port in front of an HTTP server's handlers, which a hostile client cannot exhaust. One thread reads
/// all connections without waiting for any, and passes on what has come as a whole (frame_request()): whoever
/// sends slowly or endlessly costs a place among the waiting connections and at most the limits' octets.
/// Where all places are taken, the oldest connection gives way, of the address that has most of them.
/// Requests that are urgent have workers of their own. A connection carries one request. With TLS all this
/// holds from the first octet of the handshake on.
class RequestGate {
 public:
  using IsUrgent = std::function<bool(const RequestFrame&)>;

  /// `name`: of the reading thread, as component_status shows it. `tls`: none, and HTTP is spoken without
  /// encryption; else it must outlive the gate.
  RequestGate(std::string name, const GateLimits& limits, IsUrgent is_urgent,
              const TlsContext* tls = nullptr);
  ~RequestGate() { stop(); }
  RequestGate(const RequestGate&) = delete;
  RequestGate& operator=(const RequestGate&) = delete;

  /// The handlers. Add them before start().
  httplib::Server& server() { return handlers_; }
  /// Ends HTTP on the connection of the request that the calling handler answers: `answer`, as it stands, is
  /// sent in place of the library's answer, and the connection is handed to `take`, which must not wait.
  static void switch_protocol(std::string answer, std::function<void(Channel)> take);
  /// Opens the port `wanted`, 0: any free one. Throws core::MissingError; `key` names the port in the
  /// configuration.
  void bind(const std::string& address, int wanted, const char* key);
  int port() const { return port_; }
  void start();
  /// Returns the progress of the reading thread. Any thread.
  core::LoopStatistics progress() const { return progress_.statistics(); }
  /// Closes the port and all connections, and waits for the handlers to return.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;

  struct Handlers : HttpHandlers {
    int listener() const { return svr_sock_; }
    /// Ends the answers that are being streamed.
    void close_listener();
  };
  struct Connection {
    Channel channel;
    std::string address;  ///< of the peer, as network_of() names it, for counting
    std::string octets;   ///< received so far, then the request's text
    Clock::time_point opened;
    short awaited;  ///< event of poll(2) for which its next step waits
  };
  using Connections = std::list<Connection>;

  /// Requests that wait for a worker.
  class Queue {
   public:
    /// Returns false if `most` wait, or half of that from the connection's address.
    bool put(Connection& connection, int most);
    /// Waits for a request. Returns false once the queue has ended.
    bool take(Connection& connection);
    void end();

   private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Connection> waiting_;
    bool ended_ = false;
  };

  void read_connections();
  void accept_connections();
  /// Reads what has come. Returns false if the connection is no longer waiting for its request.
  bool receive(Connection& connection);
  bool pass_on(Connection& connection);
  void make_room(const std::string& address);
  void end_late(Clock::time_point now);
  void work(Queue& queue);
  /// Answers with a status and a reason, as far as that goes without waiting, and closes.
  static void refuse(Channel& channel, int status, const std::string& reason);

  // A browser or a host that is busy otherwise may hold the thread up for longer than a servo.
  static constexpr double kTurn_s = 0.1, kHangsAfter_s = 3.0;

  core::Progress progress_;
  const GateLimits limits_;
  const IsUrgent is_urgent_;
  const TlsContext* const tls_;
  Handlers handlers_;
  int port_ = 0, wake_ = -1;
  std::atomic<bool> ending_{false};
  Connections waiting_;  // used by the reading thread only
  Queue ordinary_, urgent_;
  std::mutex answered_mutex_;
  std::set<int> answered_;  ///< descriptors that workers answer now
  std::vector<std::thread> threads_;
};

}  // namespace phantom::web
