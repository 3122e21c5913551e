#pragma once

#include <openssl/ssl.h>

#include <ctime>
#include <filesystem>
#include <memory>
#include <string>

namespace phantom::web {

/// A certificate with its private key, for the server's side of TLS 1.2 and 1.3 with OpenSSL's defaults.
/// There is no renegotiation, and nothing is kept of a session: what a client needs to resume one, it keeps
/// itself, encrypted (RFC 8446, 4.6.1; RFC 5077). Thread-safe once made.
class TlsContext {
 public:
  /// Reads PEM files: the certificate, followed by those of the authorities between it and the root, if any,
  /// and its key, of mode 0600 and without a passphrase. Throws core::MissingError with the file if one
  /// is not there, core::ConfigError if it cannot be read, is too weak, or does not fit the other.
  TlsContext(const std::filesystem::path& certificate, const std::filesystem::path& key);

  /// Returns why browsers refuse the certificate at a time, by its dates; empty if they do not.
  std::string date_fault(std::time_t now) const;
  SSL_CTX* get() const { return context_.get(); }

 private:
  struct Free {
    void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
  };
  std::unique_ptr<SSL_CTX, Free> context_;
};

}  // namespace phantom::web
