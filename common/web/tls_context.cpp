#include "common/web/tls_context.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "common/core/errors.hpp"

namespace phantom::web {
namespace {

core::ConfigError file_fault(const std::filesystem::path& file, const std::string& problem) {
  return core::ConfigError(file.string() + ": " + problem);
}

/// Returns OpenSSL's reason for its newest refusal, in brackets.
std::string openssl_reason() {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  return std::string(" (") + (reason != nullptr ? reason : "no reason is given") + ")";
}

struct stat state_of(const std::filesystem::path& file, const char* what) {
  struct stat state {};
  if (stat(file.c_str(), &state) != 0)
    throw core::MissingError(file.string() + ": cannot be read: " + std::strerror(errno) + "; " + what +
                             " of the operator's page is expected");
  if (!S_ISREG(state.st_mode)) throw file_fault(file, std::string("is no file; a PEM file is expected"));
  return state;
}

std::string utc_day(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return "a date that cannot be read";
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &parts);
  return text;
}

int no_passphrase(char*, int, int, void*) { return 0; }

}  // namespace

TlsContext::TlsContext(const std::filesystem::path& certificate, const std::filesystem::path& key)
    : context_(SSL_CTX_new(TLS_server_method())) {
  SSL_CTX* const context = context_.get();
  if (context == nullptr || SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION) != 1)
    throw core::MissingError("OpenSSL offers no TLS 1.2" + openssl_reason());
  SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                SSL_MODE_RELEASE_BUFFERS);
  // So that one step ends with one record, whatever that was: records that carry nothing hold up nobody.
  SSL_CTX_clear_mode(context, SSL_MODE_AUTO_RETRY);
  SSL_CTX_set_default_passwd_cb(context, no_passphrase);
  ERR_clear_error();
  state_of(certificate, "the certificate");
  if (SSL_CTX_use_certificate_chain_file(context, certificate.c_str()) != 1)
    throw file_fault(certificate, "is no certificate that can be used" + openssl_reason() +
                                      "; PEM is expected, the page's own certificate first");
  if ((state_of(key, "the certificate's key").st_mode & 077) != 0)
    throw file_fault(key, "a private key must be a file of mode 0600, which its owner alone may read");
  if (SSL_CTX_use_PrivateKey_file(context, key.c_str(), SSL_FILETYPE_PEM) != 1) {
    const bool other = ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH;
    throw file_fault(key, other ? "is not the key of " + certificate.string()
                                : "is no key that can be used" + openssl_reason() +
                                      "; PEM is expected, without a passphrase");
  }
  if (SSL_CTX_check_private_key(context) != 1)
    throw file_fault(key, "is not the key of " + certificate.string());
}

std::string TlsContext::date_fault(std::time_t now) const {
  const X509* const certificate = SSL_CTX_get0_certificate(context_.get());
  const ASN1_TIME *begin = X509_get0_notBefore(certificate), *end = X509_get0_notAfter(certificate);
  if (X509_cmp_time(end, &now) < 0) return "has expired on " + utc_day(end);
  if (X509_cmp_time(begin, &now) > 0) return "is not valid before " + utc_day(begin);
  return "";
}

}  // namespace phantom::web
