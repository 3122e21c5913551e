#include "common/web/request_frame.hpp"

#include <gtest/gtest.h>

#include <random>

namespace phantom::web {
namespace {

using State = RequestFrame::State;
constexpr RequestLimits kLimits{512, 64};
const std::string kHost = "Host: localhost\r\n";

RequestFrame framed(const std::string& octets) { return frame_request(octets, kLimits); }

TEST(RequestFraming, AWholeRequestIsPassedOnWithTheHeadersInUse) {
  const std::string post =
      "POST /command?x=1 HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-,0-\r\nX-A: b\r\n"
      "Content-Type:  application/json \r\nContent-Length: 4\r\n\r\n{}..rest";
  const RequestFrame frame = framed(post);
  ASSERT_EQ(frame.state, State::kComplete);
  EXPECT_EQ(frame.method, "POST");
  EXPECT_EQ(frame.path, "/command");
  EXPECT_EQ(frame.body, "{}..");
  EXPECT_EQ(frame.text,
            "POST /command?x=1 HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"
            "content-length: 4\r\n\r\n{}..");
}

TEST(RequestFraming, EveryBeginningIsIncomplete) {
  const std::string post = "POST /view HTTP/1.1\r\n" + kHost + "Content-Length: 5\r\n\r\nabcde";
  for (std::size_t size = 0; size < post.size(); ++size)
    EXPECT_EQ(framed(post.substr(0, size)).state, State::kIncomplete) << size;
  EXPECT_EQ(framed(post).state, State::kComplete);
  EXPECT_EQ(framed("GET / HTTP/1.1\r\n" + kHost + "\r\n").state, State::kComplete);
}

// Tries synthetic_viewer: a request that is too long; chunked; compressed
// Tries synthetic_viewer: not to be read in one way only
TEST(RequestFraming, WhatCannotBeBoundedOrReadInOneWayOnlyIsRefused) {
  const std::string get = "GET / HTTP/1.1\r\n", post = "POST / HTTP/1.1\r\n" + kHost;
  const std::vector<std::pair<std::string, int>> cases{
      {std::string(512, 'G'), 431},
      {get + kHost + "X: " + std::string(600, 'x'), 431},
      {get + kHost + "X: " + std::string(600, 'x') + "\r\n\r\n", 431},
      {post + "Transfer-Encoding: chunked\r\n\r\n", 411},
      {post + "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n", 411},
      {post + "TRANSFER-encoding: identity\r\n\r\n", 411},
      {post + "\r\n", 411},
      {post + "Content-Length: 65\r\n\r\n", 413},
      {post + "Content-Length: 99999999999999999999999\r\n\r\n", 413},
      {post + "Content-Length: -1\r\n\r\n", 400},
      {post + "Content-Length: +4\r\n\r\n", 400},
      {post + "Content-Length: 0x4\r\n\r\n", 400},
      {post + "Content-Length: 4, 4\r\n\r\n", 400},
      {post + "Content-Length: \r\n\r\n", 400},
      {post + "Content-Length: 4\r\nContent-Length: 4\r\n\r\n", 400},
      {post + "Content-Encoding: br\r\nContent-Length: 4\r\n\r\n", 415},
      {post + "Expect: 100-continue\r\nContent-Length: 4\r\n\r\n", 417},
      {get + kHost + "Content-Length: 4\r\n\r\n", 400},
      {get + "\r\n", 400},
      {get + kHost + kHost + "\r\n", 400},
      {get + kHost + "hOST: evil.example\r\n\r\n", 400},
      {get + "Host: 127%2e0.0.1\r\n\r\n", 400},
      {get + kHost + "Origin: http://localhost%3A8080\r\n\r\n", 400},
      {get + "Host: \r\n\r\n", 400},
      {get + kHost + "Origin:\r\n\r\n", 400},
      {get + kHost + "Sec-Fetch-Site:\r\n\r\n", 400},
      {get + kHost + "Sec-Fetch-Site: same%2Dorigin\r\n\r\n", 400},
      {get + kHost + "Cookie: a\r\nCookie: b\r\n\r\n", 400},
      {get + "Host : localhost\r\n\r\n", 400},
      {get + " Host: localhost\r\n\r\n", 400},
      {get + kHost + " folded: x\r\n\r\n", 400},
      {get + kHost + "no colon\r\n\r\n", 400},
      {get + kHost + ": empty\r\n\r\n", 400},
      {get + kHost + "X: a\nHost: evil.example\r\n\r\n", 400},
      {get + kHost + "X: a\rHost: evil.example\r\n\r\n", 400},
      {get + kHost + "X: a" + std::string(1, '\0') + "\r\n\r\n", 400},
      {"GET / HTTP/1.1\n" + kHost + "\r\n", 400},
      {"\r\n\r\n" + get + kHost + "\r\n", 400},
      {"GET http://evil.example/ HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"GET /a b HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"GET  HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"GET /\r\n" + kHost + "\r\n", 400},
      {"GET / HTTP/2.0\r\n" + kHost + "\r\n", 505},
      {"GET / HTTP/9.9\r\n" + kHost + "\r\n", 505},
      {"PUT / HTTP/1.1\r\n" + kHost + "\r\n", 405},
      {"OPTIONS / HTTP/1.1\r\n" + kHost + "\r\n", 405},
      {"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505},
  };
  for (const auto& [octets, status] : cases) {
    const RequestFrame frame = framed(octets);
    EXPECT_EQ(frame.state, State::kRefused) << octets;
    EXPECT_EQ(frame.status, status) << octets;
    EXPECT_FALSE(frame.reason.empty()) << octets;
  }
  std::string many = "GET / HTTP/1.1\r\n" + kHost;
  for (int i = 0; i < 64; ++i) many += "X: y\r\n";
  EXPECT_EQ(frame_request(many + "\r\n", {8192, 0}).status, 431);
}

// Whatever comes is read without fault, and what is passed on is within the limits.
TEST(RequestFraming, RandomOctetsAndDamagedRequestsAreBounded) {
  const std::string sound =
      "POST /command HTTP/1.1\r\n" + kHost +
      "Origin: http://localhost\r\nContent-Type: a/b\r\nContent-Length: 9\r\n\r\n{\"a\": 12}";
  std::mt19937 random(7);
  const std::string pieces[] = {"\r\n", "\r", "\n", ":", " ", "\t", "HTTP/1.1", "Content-Length: 3\r\n",
                                "%",    kHost};
  for (int round = 0; round < 50'000; ++round) {
    std::string octets = sound;
    for (unsigned damage = random() % 4; damage > 0; --damage) {
      const std::size_t at = random() % (octets.size() + 1);
      switch (random() % 3) {
        case 0:
          octets.insert(at, pieces[random() % std::size(pieces)]);
          break;
        case 1:
          octets.erase(at, random() % 8);
          break;
        default:
          octets.insert(at, 1, static_cast<char>(random() % 256));
      }
    }
    const RequestFrame frame = framed(octets);
    if (frame.state != State::kComplete) continue;
    ASSERT_LE(frame.body.size(), kLimits.body);
    ASSERT_LE(frame.text.size(), kLimits.head + kLimits.body + 2);
    ASSERT_TRUE(frame.text.ends_with("\r\n\r\n" + std::string(frame.body))) << octets;
    ASSERT_EQ(frame.text.find("\r\n\r\n") + 4 + frame.body.size(), frame.text.size()) << octets;
    // What has been passed on reads the same again.
    const RequestFrame again = framed(frame.text);
    ASSERT_EQ(again.state, State::kComplete) << octets;
    ASSERT_EQ(again.text, frame.text);
    ASSERT_EQ(again.path, frame.path);
  }
}

}  // namespace
}  // namespace phantom::web
