#include "common/web/web_socket.hpp"

#include <openssl/evp.h>
#include <openssl/sha.h>
#include <sys/types.h>
#include <wslay/wslay.h>

#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "common/core/text.hpp"

namespace phantom::web {
namespace {

constexpr std::size_t kKeyOctets = 16, kKeyCharacters = 24;
constexpr std::string_view kProtocolError("\x88\x02\x03\xEA", 4);      // a farewell with code 1002
constexpr const char* kGuid = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";  // RFC 6455, 1.3

}  // namespace

std::optional<std::string> web_socket_accept(const std::string& key) {
  std::array<unsigned char, kKeyCharacters> octets{};
  // 24 characters hold 18 octets, of which two are padding.
  if (key.size() != kKeyCharacters || !key.ends_with("==") || key[kKeyOctets * 4 / 3] == '=' ||
      EVP_DecodeBlock(octets.data(), reinterpret_cast<const unsigned char*>(key.data()),
                      static_cast<int>(key.size())) != static_cast<int>(kKeyOctets + 2))
    return std::nullopt;
  const std::string text = key + kGuid;
  std::array<unsigned char, SHA_DIGEST_LENGTH> digest{};
  SHA1(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  std::array<unsigned char, 4 * ((SHA_DIGEST_LENGTH + 2) / 3) + 1> accept{};
  const int size = EVP_EncodeBlock(accept.data(), digest.data(), SHA_DIGEST_LENGTH);
  return std::string(accept.begin(), accept.begin() + size);
}

bool asks_for_web_socket(const std::string& upgrade, const std::string& connection,
                         const std::string& version) {
  const auto has = [](const std::string& list, const std::string& word) {
    return std::ranges::count(core::cells_of(core::lower_case(list)), word) != 0;
  };
  return has(upgrade, "websocket") && has(connection, "upgrade") && version == "13";
}

struct WebSocket::Wire {
  wslay_event_context_ptr context = nullptr;
  std::string_view incoming;
  std::string outgoing;
  std::vector<std::string> texts, binaries;
  bool takes_binary = false;
  std::uint64_t frames = 0;
  bool farewell = false;  // this side has said it
  bool ended = false;     // it cannot be gone on with

  void say_farewell(std::uint16_t code, std::string_view reason) {
    farewell = true;
    wslay_event_queue_close(context, code, reinterpret_cast<const std::uint8_t*>(reason.data()),
                            reason.size());
  }
  static Wire& of(void* user) { return *static_cast<Wire*>(user); }

  static ssize_t receive(wslay_event_context_ptr context, std::uint8_t* to, std::size_t most, int,
                         void* user) {
    std::string_view& from = of(user).incoming;
    const std::size_t size = std::min(most, from.size());
    if (size == 0) {
      wslay_event_set_error(context, WSLAY_ERR_WOULDBLOCK);
      return -1;
    }
    std::copy_n(from.begin(), size, to);
    from.remove_prefix(size);
    return static_cast<ssize_t>(size);
  }
  static ssize_t send(wslay_event_context_ptr, const std::uint8_t* octets, std::size_t size, int,
                      void* user) {
    of(user).outgoing.append(reinterpret_cast<const char*>(octets), size);
    return static_cast<ssize_t>(size);
  }
  static void count(wslay_event_context_ptr, const wslay_event_on_frame_recv_start_arg*, void* user) {
    ++of(user).frames;
  }
  static void take(wslay_event_context_ptr, const wslay_event_on_msg_recv_arg* message, void* user) {
    Wire& wire = of(user);
    const bool text = message->opcode == WSLAY_TEXT_FRAME, binary = message->opcode == WSLAY_BINARY_FRAME;
    if (text || (binary && wire.takes_binary))
      (text ? wire.texts : wire.binaries)
          .emplace_back(reinterpret_cast<const char*>(message->msg), message->msg_length);
    else if (binary)
      wire.say_farewell(kNoText, "a text is expected");
  }
};

WebSocket::WebSocket(std::size_t most_octets, bool takes_binary) : wire_(std::make_unique<Wire>()) {
  wire_->takes_binary = takes_binary;
  const wslay_event_callbacks callbacks{.recv_callback = Wire::receive,
                                        .send_callback = Wire::send,
                                        .genmask_callback = nullptr,
                                        .on_frame_recv_start_callback = Wire::count,
                                        .on_frame_recv_chunk_callback = nullptr,
                                        .on_frame_recv_end_callback = nullptr,
                                        .on_msg_recv_callback = Wire::take};
  if (wslay_event_context_server_init(&wire_->context, &callbacks, wire_.get()) != 0) throw std::bad_alloc();
  wslay_event_config_set_max_recv_msg_length(wire_->context, most_octets);
}

WebSocket::~WebSocket() { wslay_event_context_free(wire_->context); }

std::vector<std::string> WebSocket::receive(std::string_view octets) {
  Wire& wire = *wire_;
  wire.incoming = octets;
  wire.texts.clear();
  wire.binaries.clear();
  // What follows a farewell is passed over.
  while (!wire.ended && !wire.incoming.empty() && wslay_event_want_read(wire.context) != 0)
    wire.ended = wslay_event_recv(wire.context) != 0;
  wire.incoming = {};
  // The library gives up without a word on a frame that it cannot read.
  if (wire.ended && !std::exchange(wire.farewell, true)) wire.outgoing += kProtocolError;
  return std::move(wire.texts);
}

void WebSocket::send(bool binary, std::string_view octets) {
  if (closing()) return;
  const wslay_event_msg message{static_cast<std::uint8_t>(binary ? WSLAY_BINARY_FRAME : WSLAY_TEXT_FRAME),
                                reinterpret_cast<const std::uint8_t*>(octets.data()), octets.size()};
  wire_->ended = wslay_event_queue_msg(wire_->context, &message) != 0;
}

void WebSocket::close(std::uint16_t code, std::string_view reason) {
  if (!closing()) wire_->say_farewell(code, reason);
}

std::string& WebSocket::output() {
  Wire& wire = *wire_;
  while (!wire.ended && wslay_event_want_write(wire.context) != 0)
    wire.ended = wslay_event_send(wire.context) != 0;
  return wire.outgoing;
}

const std::vector<std::string>& WebSocket::binaries() const { return wire_->binaries; }

std::uint64_t WebSocket::frames() const { return wire_->frames; }

bool WebSocket::closing() const {
  // The library reads no more once it has queued a farewell by itself.
  return wire_->ended || wire_->farewell || wslay_event_get_read_enabled(wire_->context) == 0;
}

bool WebSocket::closed() const {
  return wire_->ended || (wslay_event_get_close_sent(wire_->context) != 0 &&
                          (wslay_event_get_close_received(wire_->context) != 0 ||
                           wslay_event_get_read_enabled(wire_->context) == 0));
}

}  // namespace phantom::web
