#pragma once
// A follower of the scene stream without a browser.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "common/web/tests/web_socket_frames.hpp"
#include "components/synthetic_viewer/stream/tests/scene_decoder.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer::test {

using phantom::test::eventually;

/// A browser's socket, without a browser.
class RawClient {
 public:
  RawClient(int port, const std::string& headers = "", const std::string& trusted = "") {
    descriptor_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in remote{};
    remote.sin_family = AF_INET;
    inet_pton(AF_INET, "127.0.0.1", &remote.sin_addr);
    remote.sin_port = htons(static_cast<std::uint16_t>(port));
    EXPECT_EQ(connect(descriptor_, reinterpret_cast<sockaddr*>(&remote), sizeof remote), 0);
    const timeval patience{0, 200'000};
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (!trusted.empty()) begin_tls(trusted);
    put("GET /scene HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
        (headers.empty() ? kUpgrade : headers) + "\r\n");
    const bool answered = eventually([&] {
      pull();
      return octets_.find("\r\n\r\n") != std::string::npos || closed_;
    });
    EXPECT_TRUE(answered);
    const std::size_t end = std::min(octets_.find("\r\n\r\n"), octets_.size() - 4) + 4;
    head = octets_.substr(0, end);
    octets_.erase(0, end);
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() {
    SSL_free(ssl_);
    close(descriptor_);
    SSL_CTX_free(context_);
  }
  inline static const std::string kUpgrade =
      "Upgrade: websocket\r\nConnection: keep-alive, Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

  bool put(const std::string& octets) {
    if (ssl_ != nullptr) return SSL_write(ssl_, octets.data(), static_cast<int>(octets.size())) > 0;
    return ::send(descriptor_, octets.data(), octets.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(octets.size());
  }
  /// Reads what comes until `enough`; false if it does not come in a minute, or the server closes before.
  bool read_until(const std::function<bool()>& enough) {
    return eventually([&] {
             pull();
             for (web::test::ServerFrame frame; web::test::take_frame(octets_, frame);) {
               if (frame.opcode == 1) scene.take_text(frame.content);
               if (frame.opcode == 2) scene.take_binary(frame.content);
               if (frame.opcode == 10) ++pongs;
               if (frame.opcode == 8 && frame.content.size() >= 2)
                 code = static_cast<std::uint8_t>(frame.content[0]) << 8 |
                        static_cast<std::uint8_t>(frame.content[1]);
             }
             return enough() || closed_;
           }) &&
           enough();
  }
  bool is_closed_with(int wanted) {
    return read_until([&] { return code != 0; }) && code == wanted && read_until([&] { return closed_; });
  }
  bool ends() {
    return read_until([&] { return closed_; });
  }

  std::string head;
  DecodedScene scene;
  int code = 0, pongs = 0;

 private:
  void begin_tls(const std::string& trusted) {
    context_ = SSL_CTX_new(TLS_client_method());
    EXPECT_EQ(SSL_CTX_load_verify_locations(context_, trusted.c_str(), nullptr), 1);
    SSL_CTX_set_verify(context_, SSL_VERIFY_PEER, nullptr);
    ssl_ = SSL_new(context_);
    SSL_set_fd(ssl_, descriptor_);
    EXPECT_TRUE(eventually([&] { return SSL_connect(ssl_) == 1; }));
  }
  void pull() {
    char part[65536];
    const auto size = ssl_ != nullptr ? SSL_read(ssl_, part, sizeof part)
                                      : static_cast<int>(recv(descriptor_, part, sizeof part, 0));
    if (size > 0) return octets_.append(part, static_cast<std::size_t>(size)), void();
    const bool waits = ssl_ != nullptr ? SSL_get_error(ssl_, size) == SSL_ERROR_WANT_READ
                                       : size < 0 && (errno == EAGAIN || errno == EINTR);
    closed_ = !waits;
  }

  int descriptor_ = -1;
  SSL_CTX* context_ = nullptr;
  SSL* ssl_ = nullptr;
  std::string octets_;
  bool closed_ = false;
};

}  // namespace phantom::synthetic_viewer::test
