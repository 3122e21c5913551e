// The server's side of a WebSocket against frames written by hand (RFC 6455, 5.2).
#include "common/web/web_socket.hpp"

#include <gtest/gtest.h>

#include "common/web/tests/web_socket_frames.hpp"

namespace phantom::web::web_socket_test {
namespace {

using test::client_frame;
using test::close_code;
using Texts = std::vector<std::string>;

TEST(WebSocketOf, TheHandshakesAnswerIsThatOfTheRfc) {
  EXPECT_EQ(web_socket_accept("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  for (const char* key : {"", "dGhlIHNhbXBsZSBub25jZQ", "dGhlIHNhbXBsZSBub25j", "dGhlIHNhbXBsZSBub25jZWFi",
                          "dGhl!HNhbXBsZSBub25jZQ==", "dGhlIHNhbXBsZSBub25jZQ==dGhlIHNhbXBsZSBub25jZQ=="})
    EXPECT_FALSE(web_socket_accept(key)) << key;
}

TEST(WebSocketOf, ATextComesWholeHoweverItIsCut) {
  const std::string whole = client_frame(1, "Hello"),
                    parts = client_frame(1, "Hel", false) + client_frame(0, "lo");
  for (const std::string& octets : {whole, parts}) {
    for (std::size_t cut = 0; cut <= octets.size(); ++cut) {
      WebSocket socket(128);
      Texts texts = socket.receive(octets.substr(0, cut));
      for (std::string& text : socket.receive(octets.substr(cut))) texts.push_back(std::move(text));
      EXPECT_EQ(texts, Texts{"Hello"}) << cut;
      EXPECT_TRUE(socket.output().empty());
    }
  }
}

TEST(WebSocketOf, MessagesGoUnmaskedAndPingsAreAnswered) {
  WebSocket socket(128);
  socket.send(false, "abc");
  EXPECT_EQ(socket.output(),
            "\x81\x03"
            "abc");
  socket.output().clear();
  socket.send(true, std::string(300, 'x'));
  EXPECT_EQ(socket.output(), std::string("\x82\x7E\x01\x2C", 4) + std::string(300, 'x'));
  socket.output().clear();
  EXPECT_TRUE(socket.receive(client_frame(9, "are you there")).empty());
  EXPECT_EQ(socket.output(),
            "\x8A\x0D"
            "are you there");
}

TEST(WebSocketOf, WhatBreaksTheRulesIsClosedWithItsCode) {
  struct Case {
    const char* what;
    std::string octets;
    int code;
  };
  const std::string unmasked("\x81\x02hi", 4), reserved_bit = "\xC1" + client_frame(1, "hi").substr(1),
                                               unknown_kind = client_frame(3, "hi"),
                                               loose = client_frame(0, "hi");
  for (const Case& one :
       {Case{"not masked", unmasked, 1002}, Case{"a reserved bit", reserved_bit, 1002},
        Case{"an unknown kind", unknown_kind, 1002}, Case{"a continuation of nothing", loose, 1002},
        Case{"a long ping", client_frame(9, std::string(126, 'x')), 1002},
        Case{"binary", client_frame(2, "hi"), 1003}, Case{"no UTF-8", client_frame(1, "\xC3\x28"), 1007},
        Case{"too long", client_frame(1, std::string(129, 'x')), 1009},
        Case{"too long, announced alone",
             std::string("\x81\xFF\x00\x00\x7F\x00\x00\x00\x00\x00", 10) + "maskx", 1009},
        Case{"too long in parts",
             client_frame(1, std::string(100, 'x'), false) + client_frame(0, std::string(100, 'x')), 1009}}) {
    WebSocket socket(128);
    EXPECT_TRUE(socket.receive(one.octets).empty()) << one.what;
    EXPECT_EQ(close_code(socket.output()), one.code) << one.what;
    EXPECT_TRUE(socket.closing()) << one.what;
    const std::size_t size = socket.output().size();
    socket.send(true, "more");
    EXPECT_EQ(socket.output().size(), size) << one.what << ": nothing follows a farewell";
  }
}

TEST(WebSocketOf, BinaryMessagesComeWholeWhereTheyAreTaken) {
  WebSocket socket(128, true);
  EXPECT_EQ(
      socket.receive(client_frame(2, std::string("\0\1", 2)) + client_frame(1, "a") + client_frame(2, "b")),
      Texts{"a"});
  EXPECT_EQ(socket.binaries(), (Texts{std::string("\0\1", 2), "b"}));
  EXPECT_TRUE(socket.receive(client_frame(1, "c")).size() == 1 && socket.binaries().empty());
  socket.receive(client_frame(2, std::string(129, 'x')));
  EXPECT_EQ(close_code(socket.output()), 1009);
}

TEST(WebSocketOf, AFarewellIsAnsweredAndEndsIt) {
  WebSocket socket(128);
  socket.receive(client_frame(8, std::string("\x03\xE8", 2)));
  EXPECT_EQ(close_code(socket.output()), 1000);
  EXPECT_TRUE(socket.closed());
  WebSocket mine(128);
  mine.close(4001, "over");
  EXPECT_EQ(close_code(mine.output()), 4001);
  EXPECT_TRUE(mine.closing());
  EXPECT_FALSE(mine.closed()) << "the other side's is waited for";
  mine.receive(client_frame(8, std::string("\x0F\xA1", 2)));
  EXPECT_TRUE(mine.closed());
}

}  // namespace
}  // namespace phantom::web::web_socket_test
