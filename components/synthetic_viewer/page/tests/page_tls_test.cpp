// The page by https, to clients that keep to TLS and to those that do not.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "common/web/tests/certificate.hpp"
#include "common/web/tls_context.hpp"
#include "components/synthetic_viewer/page/tests/page_rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;
using web::test::Certificate;

/// What a client of TLS 1.3 begins with: the head of a record, and of the ClientHello in it.
const std::string kHalfHello = std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xFC\x03\x03", 11);

class PageOverTls : public test::Page {
 protected:
  void serve_tls(PageConfig config = {}) {
    config.tls = std::make_shared<web::TlsContext>(own_.certificate, own_.key);
    trusted_ = own_.certificate;
    serve(config);
  }
  /// A connection on which nothing has been sent, from an address of loopback.
  static int connected(int port, const std::string& from = "127.0.0.1") {
    const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in local{}, remote{};
    local.sin_family = remote.sin_family = AF_INET;
    inet_pton(AF_INET, from.c_str(), &local.sin_addr);
    inet_pton(AF_INET, "127.0.0.1", &remote.sin_addr);
    remote.sin_port = htons(static_cast<std::uint16_t>(port));
    EXPECT_EQ(::bind(descriptor, reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    EXPECT_EQ(connect(descriptor, reinterpret_cast<sockaddr*>(&remote), sizeof remote), 0);
    const timeval patience{20, 0};
    setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    return descriptor;
  }
  static bool put(int descriptor, const std::string& octets) {
    return send(descriptor, octets.data(), octets.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(octets.size());
  }
  /// All that comes until the server closes, which it must do before the patience ends.
  static std::string rest_of(int descriptor) {
    std::string got;
    char octets[4096];
    ssize_t size = 0;
    while ((size = recv(descriptor, octets, sizeof octets, 0)) > 0)
      got.append(octets, static_cast<std::size_t>(size));
    EXPECT_TRUE(size == 0 || errno == ECONNRESET) << "the server has not closed";
    close(descriptor);
    return got;
  }
  /// The version that a client agrees on with the server which allows versions up to `greatest`; empty: none.
  std::string agreed(int greatest) const {
    const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                    SSL_CTX_free);
    SSL_CTX_set_min_proto_version(context.get(), TLS1_VERSION);
    SSL_CTX_set_max_proto_version(context.get(), greatest);
    SSL_CTX_set_security_level(context.get(), 0);
    const std::unique_ptr<SSL, decltype(&SSL_free)> ssl(SSL_new(context.get()), SSL_free);
    const int descriptor = connected(server_->port());
    SSL_set_fd(ssl.get(), descriptor);
    const std::string version = SSL_connect(ssl.get()) == 1 ? SSL_get_version(ssl.get()) : "";
    close(descriptor);
    return version;
  }

  Certificate own_;
};

TEST_F(PageOverTls, IsThePageWithAllThatNamesItsScheme) {
  PageConfig config;
  config.secrets = runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
  serve_tls(config);
  const std::string own = "https://127.0.0.1:" + std::to_string(server_->port());
  EXPECT_EQ(server_->url(), own + "/");
  const auto index = client().Get("/");
  ASSERT_TRUE(index) << httplib::to_string(index.error());
  EXPECT_THAT(index->body, HasSubstr("Emergency stop"));
  const std::string streams = "://127.0.0.1:" + std::to_string(server_->stream_port());
  EXPECT_THAT(index->get_header_value("Content-Security-Policy"),
              HasSubstr("connect-src 'self' https" + streams + " wss" + streams + ";"));
  const auto opened = client().Post("/login", R"({"secret":"operate-operate-1"})", "application/json");
  ASSERT_EQ(opened->status, 200);
  EXPECT_THAT(opened->get_header_value("Set-Cookie"), HasSubstr("; Secure;"));
  const std::string stop = R"({"kind":"emergency_stop"})";
  EXPECT_EQ(post(stop, {{"Origin", own}}).first, 200);
  EXPECT_EQ(post(stop, {{"Origin", "http" + own.substr(5)}}).first, 403) << "the same host without TLS";
  EXPECT_EQ(post(stop, {{"Host", "elsewhere.example"}}).first, 403);
  EXPECT_EQ(client().Get("/stop", {{"Host", "elsewhere.example"}})->status, 403);
  EXPECT_EQ(commands_.size(), 1U);
}

TEST_F(PageOverTls, StreamsPicturesOfMoreThanARecord) {
  serve_tls();
  const std::string picture = "\xFF\xD8" + std::string(300'000, 'x') + "end";
  content_.view(View::kMain).jpeg.publish(picture);
  EXPECT_THAT(
      follow("/stream/main", [](const std::string& text) { return text.find("xend") != std::string::npos; }),
      HasSubstr(picture));
}

TEST_F(PageOverTls, SendsTheChainAlong) {
  const Certificate root("root"), between("between", &root), leaf("localhost", &between);
  const auto chain = phantom::test::new_file(
      phantom::test::text_of(leaf.certificate) + phantom::test::text_of(between.certificate), ".pem");
  PageConfig config;
  config.tls = std::make_shared<web::TlsContext>(chain, leaf.key);
  trusted_ = root.certificate;
  serve(config);
  const auto page = client().Get("/");
  EXPECT_TRUE(page) << httplib::to_string(page.error());
  config.tls = std::make_shared<web::TlsContext>(leaf.certificate, leaf.key);
  serve(config);
  EXPECT_FALSE(client().Get("/")) << "without the one between it is not known";
}

TEST_F(PageOverTls, OldVersionsAreRefused) {
  serve_tls();
  EXPECT_EQ(agreed(TLS1_VERSION), "");
  EXPECT_EQ(agreed(TLS1_1_VERSION), "");
  EXPECT_EQ(agreed(TLS1_2_VERSION), "TLSv1.2");
  EXPECT_EQ(agreed(TLS1_3_VERSION), "TLSv1.3");
}

// Tries synthetic_viewer: HTTP on a port with TLS
TEST_F(PageOverTls, WhoSpeaksHttpIsToldAndOthersAreCutOff) {
  serve_tls();
  for (const int port : {server_->port(), server_->stream_port()}) {
    const int plain = connected(port);
    put(plain, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_THAT(rest_of(plain), ::testing::AllOf(HasSubstr("HTTP/1.1 400 "), HasSubstr("speaks https")));
    const int garbage = connected(port);
    put(garbage, std::string(20, '\x55'));
    EXPECT_EQ(rest_of(garbage).find("HTTP"), std::string::npos);
  }
  EXPECT_EQ(client().Get("/stop")->status, 200);
}

// A hundred clients that begin a handshake and do not go on; others finish it and send nothing.
// Tries synthetic_viewer: a handshake that does not come
TEST_F(PageOverTls, AStopIsServedWhileHandshakesHangAndTheseEndInTime) {
  serve_tls();
  using Clock = std::chrono::steady_clock;
  const auto begun = Clock::now();
  std::vector<int> hanging;
  for (int i = 0; i < 100; ++i) {
    hanging.push_back(connected(server_->port(), "127.0.1." + std::to_string(1 + i % 8)));
    put(hanging.back(), kHalfHello.substr(0, static_cast<std::size_t>(i) % (kHalfHello.size() + 1)));
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(post(R"({"kind":"emergency_stop"})").first, 200);
  EXPECT_EQ(commands_.size(), 5U);
  // The oldest give way to those that come when all places are taken; the later half has its time.
  for (std::size_t i = 0; i < hanging.size(); ++i) {
    EXPECT_EQ(rest_of(hanging[i]), "") << "no word before the handshake";
    if (i >= hanging.size() / 2) {
      EXPECT_GE(Clock::now() - begun, std::chrono::milliseconds(2950)) << i;
    }
  }
  EXPECT_LT(Clock::now() - begun, std::chrono::seconds(8)) << "and on a busy host not much more";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
