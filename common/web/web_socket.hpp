#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

struct wslay_event_context;

namespace phantom::web {

/// Returns the Sec-WebSocket-Accept for a Sec-WebSocket-Key (RFC 6455, 4.2.2); none for a text that is not 16
/// octets in base64.
std::optional<std::string> web_socket_accept(const std::string& key);

/// Returns whether the headers Upgrade, Connection and Sec-WebSocket-Version ask for a WebSocket.
bool asks_for_web_socket(const std::string& upgrade, const std::string& connection,
                         const std::string& version);

/// The server's side of a WebSocket (RFC 6455) after its handshake, without a socket: octets in, messages
/// out, and the other way round. Pings are answered; what breaks the protocol, is no text where nothing else
/// is taken, or longer than `most_octets`, closes it with the code that the RFC names. Bounded in memory: at
/// most a frame's header and `most_octets` of what comes, and of what goes what the caller has sent. One
/// thread.
class WebSocket {
 public:
  static constexpr std::uint16_t kGoingAway = 1001, kNoText = 1003, kNoSense = 1007, kPolicy = 1008;

  /// `takes_binary`: binary messages, too.
  explicit WebSocket(std::size_t most_octets, bool takes_binary = false);
  ~WebSocket();
  WebSocket(const WebSocket&) = delete;
  WebSocket& operator=(const WebSocket&) = delete;

  /// Takes octets from the client. Returns the texts that have come as a whole.
  std::vector<std::string> receive(std::string_view octets);
  /// Returns the binary messages that came as a whole with the octets of the last receive().
  const std::vector<std::string>& binaries() const;
  /// Queues a message. Does nothing once the closing has begun.
  void send(bool binary, std::string_view octets);
  /// Says farewell; nothing else is sent then.
  void close(std::uint16_t code, std::string_view reason);
  /// Returns the octets for the client. The caller takes off what it has sent.
  std::string& output();
  /// Returns the number of frames that have come, pings included.
  std::uint64_t frames() const;
  /// Returns whether this side has said farewell, by itself or in answer.
  bool closing() const;
  /// Returns whether both sides have said farewell: the connection is to be cut once output() is empty.
  bool closed() const;

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace phantom::web
