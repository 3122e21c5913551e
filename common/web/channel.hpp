#pragma once

#include <openssl/ssl.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace phantom::web {

class TlsContext;

/// One end of a connection, as the kernel names it.
struct EndPoint {
  std::string address;
  int port = 0;
};

/// An accepted TCP connection, with TLS or without. Its steps wait for nothing, and say for what the next one
/// has to wait. One thread at a time.
class Channel {
 public:
  enum class Step {
    kDone,        ///< some octets went through
    kWantsRead,   ///< none did; again once the descriptor is readable
    kWantsWrite,  ///< none did; again once it is writable
    kClosed,      ///< by the other side, or because it does not keep to the protocol
    kNoTls        ///< HTTP came where TLS is expected; from now on octets are sent as they are
  };

  /// No connection.
  Channel() = default;
  /// Takes a descriptor, which must not block. `context`: none, and octets go as they are; else it must
  /// outlive the channel, whose first steps are the handshake.
  Channel(int descriptor, const TlsContext* context);
  Channel(Channel&& other) noexcept { *this = std::move(other); }
  Channel& operator=(Channel&& other) noexcept;
  ~Channel() { close(); }

  /// Reads at most `most` octets.
  Step read(char* octets, std::size_t most, std::size_t& got);
  /// Writes the first octets of a text, as many as there is room for. The kernel ignores SIGPIPE for this
  /// process, as runtime::process_main() has asked for.
  Step write(std::string_view octets, std::size_t& sent);
  /// Returns whether octets can be written: the handshake is over.
  bool ready() const { return descriptor_ >= 0 && !failed_ && (!ssl_ || SSL_is_init_finished(ssl_.get())); }
  /// Says that nothing more will be written, as far as that goes without waiting.
  void end_writing();
  void close();

  int descriptor() const { return descriptor_; }
  EndPoint local() const;
  EndPoint remote() const;
  /// Waits until poll(2) finds an event. Returns whether it has.
  static bool wait_for(int descriptor, short events, std::chrono::milliseconds patience);

 private:
  struct Free {
    void operator()(SSL* ssl) const { SSL_free(ssl); }
  };
  Step step_of(int result);
  static Step plain_step();

  int descriptor_ = -1;
  std::unique_ptr<SSL, Free> ssl_;
  bool failed_ = false;  ///< after a fatal error OpenSSL must not be asked for more
};

}  // namespace phantom::web
