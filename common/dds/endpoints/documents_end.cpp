#include "common/dds/endpoints/documents_end.hpp"

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/dds/endpoints/security.hpp"

namespace phantom::dds {
namespace {

core::Nanoseconds utc_of(std::tm parts) { return core::Nanoseconds{timegm(&parts)} * core::kNsPerSecond; }

std::optional<core::Nanoseconds> end_of_certificate(const std::filesystem::path& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "r"), &std::fclose);
  if (!stream) return std::nullopt;
  const std::unique_ptr<X509, void (*)(X509*)> certificate(
      PEM_read_X509(stream.get(), nullptr, nullptr, nullptr), &X509_free);
  std::tm parts{};
  if (!certificate || ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &parts) != 1)
    return std::nullopt;
  return utc_of(parts);
}

// Of a signed text of XML; of several grants the first to end.
std::optional<core::Nanoseconds> end_of_permissions(const std::filesystem::path& file) {
  constexpr std::string_view kElement = "<not_after>";
  std::ostringstream stream;
  stream << std::ifstream(file).rdbuf();
  const std::string text = stream.str();
  std::optional<core::Nanoseconds> first;
  for (auto at = text.find(kElement); at != std::string::npos; at = text.find(kElement, at + 1)) {
    std::tm parts{};
    if (strptime(text.c_str() + at + kElement.size(), "%Y-%m-%dT%H:%M:%S", &parts) == nullptr) continue;
    const core::Nanoseconds ends = utc_of(parts);
    if (!first || ends < *first) first = ends;
  }
  return first;
}

}  // namespace

std::optional<DocumentsEnd> documents_end(const std::filesystem::path& folder,
                                          const std::string& participant) {
  const std::filesystem::path own = folder / identity_name(participant);
  std::optional<DocumentsEnd> first;
  const auto look = [&first](const std::filesystem::path& file, std::optional<core::Nanoseconds> ends) {
    if (ends && (!first || *ends < first->utc_ns)) first = DocumentsEnd{file, *ends};
  };
  for (const auto& file : {own / "identity.pem", folder / "identity_ca.pem", folder / "permissions_ca.pem"})
    look(file, end_of_certificate(file));
  look(own / "permissions.p7s", end_of_permissions(own / "permissions.p7s"));
  return first;
}

void add_documents_end(core::Health& health, const DocumentsEnd& end, core::Nanoseconds utc_ns) {
  const core::Nanoseconds left_ns = end.utc_ns - utc_ns;
  if (left_ns > kDocumentsMargin_ns) return;
  const double days = std::floor(core::seconds(left_ns) / 86'400.0);
  health.figures.push_back({"security_days_left", days, "d"});
  health.message += (health.message.empty() ? "" : "; ") + end.document.string() +
                    (left_ns > 0 ? " ends in " + std::to_string(static_cast<long>(days)) + " days"
                                 : std::string(" has ended")) +
                    ": deploy/security/make rotate gives new documents";
}

}  // namespace phantom::dds
