#include "common/web/channel.hpp"

#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "common/web/tls_context.hpp"

namespace phantom::web {
namespace {

// Octets that are read before the handshake is over: a browser's are below 2,000.
constexpr std::uint64_t kMaxOfHandshake = 32768;

EndPoint end_point_of(const sockaddr_storage& address) {
  EndPoint end;
  std::array<char, INET6_ADDRSTRLEN> text{};
  const void* octets = nullptr;
  if (address.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address);
    octets = &four.sin_addr;
    end.port = ntohs(four.sin_port);
  } else {
    const auto& six = reinterpret_cast<const sockaddr_in6&>(address);
    octets = &six.sin6_addr;
    end.port = ntohs(six.sin6_port);
  }
  if (inet_ntop(address.ss_family, octets, text.data(), text.size()) != nullptr) end.address = text.data();
  return end;
}

}  // namespace

Channel::Channel(int descriptor, const TlsContext* context) : descriptor_(descriptor) {
  if (context == nullptr) return;
  ssl_.reset(SSL_new(context->get()));
  failed_ = !ssl_ || SSL_set_fd(ssl_.get(), descriptor) != 1;
  if (!failed_) SSL_set_accept_state(ssl_.get());
}

Channel& Channel::operator=(Channel&& other) noexcept {
  close();
  descriptor_ = std::exchange(other.descriptor_, -1);
  ssl_ = std::move(other.ssl_);
  failed_ = other.failed_;
  return *this;
}

Channel::Step Channel::plain_step() {
  return errno == EAGAIN || errno == EINTR ? Step::kWantsRead : Step::kClosed;
}

Channel::Step Channel::step_of(int result) {
  switch (SSL_get_error(ssl_.get(), result)) {
    case SSL_ERROR_WANT_READ:
      break;
    case SSL_ERROR_WANT_WRITE:
      return Step::kWantsWrite;
    case SSL_ERROR_ZERO_RETURN:  // it has taken leave
      return Step::kClosed;
    default:
      failed_ = true;
      if (ERR_GET_REASON(ERR_peek_error()) != SSL_R_HTTP_REQUEST) return Step::kClosed;
      ssl_.reset();
      failed_ = false;
      return Step::kNoTls;
  }
  const bool endless =
      !SSL_is_init_finished(ssl_.get()) && BIO_number_read(SSL_get_rbio(ssl_.get())) > kMaxOfHandshake;
  failed_ = failed_ || endless;
  return endless ? Step::kClosed : Step::kWantsRead;
}

Channel::Step Channel::read(char* octets, std::size_t most, std::size_t& got) {
  got = 0;
  if (failed_) return Step::kClosed;
  if (ssl_) {
    ERR_clear_error();  // SSL_get_error() looks at this thread's list
    const int result = SSL_read_ex(ssl_.get(), octets, most, &got);
    return result == 1 ? Step::kDone : step_of(result);
  }
  const ssize_t size = recv(descriptor_, octets, most, 0);
  if (size < 0) return plain_step();
  got = static_cast<std::size_t>(size);
  return size > 0 ? Step::kDone : Step::kClosed;
}

Channel::Step Channel::write(std::string_view octets, std::size_t& sent) {
  sent = 0;
  if (failed_) return Step::kClosed;
  if (ssl_) {
    ERR_clear_error();
    const int result = SSL_write_ex(ssl_.get(), octets.data(), octets.size(), &sent);
    return result == 1 ? Step::kDone : step_of(result);
  }
  const ssize_t size = send(descriptor_, octets.data(), octets.size(), MSG_NOSIGNAL);
  if (size < 0) return plain_step() == Step::kClosed ? Step::kClosed : Step::kWantsWrite;
  sent = static_cast<std::size_t>(size);
  return Step::kDone;
}

void Channel::end_writing() {
  if (ssl_ && ready()) {
    ERR_clear_error();
    SSL_shutdown(ssl_.get());  // sends the notice; the other side's is not waited for
  }
  if (descriptor_ >= 0) shutdown(descriptor_, SHUT_WR);
}

void Channel::close() {
  ssl_.reset();
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

EndPoint Channel::local() const {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const int got = getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
  return got == 0 ? end_point_of(address) : EndPoint();
}

EndPoint Channel::remote() const {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const int got = getpeername(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
  return got == 0 ? end_point_of(address) : EndPoint();
}

bool Channel::wait_for(int descriptor, short events, std::chrono::milliseconds patience) {
  pollfd one{descriptor, events, 0};
  return poll(&one, 1, static_cast<int>(patience.count())) > 0 && (one.revents & events) != 0;
}

}  // namespace phantom::web
