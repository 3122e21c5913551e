#include "common/web/channel.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <memory>

#include "common/web/tests/certificate.hpp"
#include "common/web/tls_context.hpp"

namespace phantom::web {
namespace {

using Step = Channel::Step;

/// A channel and the other end of its connection, neither of which blocks.
class ChannelSteps : public ::testing::Test {
 protected:
  explicit ChannelSteps(const TlsContext* context = nullptr) {
    std::signal(SIGPIPE, SIG_IGN);  // as in every process of ours
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    channel_ = Channel(ends[0], context);
    other_ = ends[1];
  }
  ~ChannelSteps() override { close(other_); }
  bool put(const std::string& octets) const {
    return send(other_, octets.data(), octets.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(octets.size());
  }
  Step read_step() {
    char octets[64];
    std::size_t got = 0;
    const Step step = channel_.read(octets, sizeof octets, got);
    got_.append(octets, got);
    return step;
  }

  Channel channel_;
  int other_ = -1;
  std::string got_;
};

TEST_F(ChannelSteps, WithoutTlsOctetsGoAsTheyAre) {
  EXPECT_TRUE(channel_.ready());
  EXPECT_EQ(read_step(), Step::kWantsRead);
  put("question");
  EXPECT_EQ(read_step(), Step::kDone);
  EXPECT_EQ(got_, "question");
  std::size_t sent = 0;
  EXPECT_EQ(channel_.write("answer", sent), Step::kDone);
  EXPECT_EQ(sent, 6U);
  const std::string much(1 << 20, 'x');
  Step step = Step::kDone;
  for (int i = 0; i < 100 && step == Step::kDone; ++i) step = channel_.write(much, sent);
  EXPECT_EQ(step, Step::kWantsWrite) << "nobody reads";
  close(other_);
  EXPECT_EQ(read_step(), Step::kClosed);
  EXPECT_EQ(channel_.write("answer", sent), Step::kClosed);
}

class TlsSteps : public ChannelSteps {
 protected:
  TlsSteps() : ChannelSteps(&context()) {
    SSL_set_fd(client_.get(), other_);
    SSL_set_connect_state(client_.get());
  }
  static const TlsContext& context() {
    static const test::Certificate own;
    static const TlsContext made(own.certificate, own.key);
    return made;
  }
  void shake_hands() {
    for (int i = 0; i < 10 && SSL_do_handshake(client_.get()) != 1; ++i) read_step();
    EXPECT_EQ(read_step(), Step::kWantsRead);
    EXPECT_TRUE(channel_.ready());
  }

  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> client_context_{SSL_CTX_new(TLS_client_method()),
                                                                          SSL_CTX_free};
  const std::unique_ptr<SSL, decltype(&SSL_free)> client_{SSL_new(client_context_.get()), SSL_free};
};

TEST_F(TlsSteps, OctetsGoOnceTheHandshakeIsOverAndTheEndIsSaid) {
  EXPECT_FALSE(channel_.ready());
  EXPECT_EQ(read_step(), Step::kWantsRead);
  shake_hands();
  SSL_write(client_.get(), "question", 8);
  EXPECT_EQ(read_step(), Step::kDone);
  EXPECT_EQ(got_, "question");
  std::size_t sent = 0;
  EXPECT_EQ(channel_.write("answer", sent), Step::kDone);
  Channel moved = std::move(channel_);
  moved.end_writing();
  moved.close();
  char answer[16];
  EXPECT_EQ(SSL_read(client_.get(), answer, sizeof answer), 6);
  EXPECT_EQ(SSL_get_error(client_.get(), SSL_read(client_.get(), answer, sizeof answer)),
            SSL_ERROR_ZERO_RETURN);
}

TEST_F(TlsSteps, AHandshakeIsBoundedByItsOctets) {
  // A ClientHello of 130,000 octets, which OpenSSL would take, in records of 1 KiB.
  const auto record = [](const std::string& text) {
    return std::string("\x16\x03\x01\x04\x00", 5) + text + std::string(1024 - text.size(), '\x01');
  };
  put(record(std::string("\x01\x01\xFB\xD0\x03\x03", 6)));
  int records = 1;
  for (; records < 120 && read_step() == Step::kWantsRead; ++records) put(record(""));
  EXPECT_GT(records, 30);
  EXPECT_LT(records, 36);
  EXPECT_EQ(read_step(), Step::kClosed);
  EXPECT_FALSE(channel_.ready());
}

TEST_F(TlsSteps, HttpIsKnownAndCanBeAnswered) {
  put("GET / HTTP/1.1\r\n\r\n");
  EXPECT_EQ(read_step(), Step::kNoTls);
  EXPECT_TRUE(channel_.ready());
  std::size_t sent = 0;
  EXPECT_EQ(channel_.write("HTTP/1.1 400", sent), Step::kDone);
  char answer[32];
  EXPECT_EQ(recv(other_, answer, sizeof answer, 0), 12);
}

TEST_F(TlsSteps, WhatIsNoTlsIsClosedAndStaysSo) {
  put(std::string(100, '\x55'));
  EXPECT_EQ(read_step(), Step::kClosed);
  EXPECT_EQ(read_step(), Step::kClosed);
  std::size_t sent = 0;
  EXPECT_EQ(channel_.write("x", sent), Step::kClosed);
  channel_.end_writing();
}

TEST_F(TlsSteps, ThereIsNoRenegotiation) {
  SSL_set_max_proto_version(client_.get(), TLS1_2_VERSION);
  shake_hands();
  EXPECT_EQ(SSL_renegotiate(client_.get()), 1);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NE(SSL_do_handshake(client_.get()), 1);
    read_step();
  }
}

// Each new key is one step, so that a client that sends nothing else holds up nobody.
TEST_F(TlsSteps, NewKeysAreOneStepEach) {
  SSL_set_min_proto_version(client_.get(), TLS1_3_VERSION);
  shake_hands();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(SSL_key_update(client_.get(), SSL_KEY_UPDATE_NOT_REQUESTED), 1);
    EXPECT_EQ(SSL_do_handshake(client_.get()), 1);
  }
  SSL_write(client_.get(), "after", 5);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(read_step(), Step::kWantsRead) << i;
  EXPECT_EQ(read_step(), Step::kDone);
  EXPECT_EQ(got_, "after");
}

}  // namespace
}  // namespace phantom::web
