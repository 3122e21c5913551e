#include "common/dds/endpoints/security.hpp"

#include <unistd.h>

#include <cctype>

#include "common/core/errors.hpp"

namespace phantom::dds {

std::string identity_name(const std::string& participant) {
  std::string name = participant;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-') c = '_';
  }
  return name;
}

std::vector<std::pair<std::string, std::string>> security_properties(const std::filesystem::path& folder,
                                                                     const std::string& participant) {
  std::vector<std::pair<std::string, std::string>> properties;
  const std::filesystem::path own = identity_name(participant);
  const auto add = [&](const char* name, const std::string& value) { properties.emplace_back(name, value); };
  const auto add_file = [&](const char* name, const std::filesystem::path& file) {
    const std::filesystem::path path = std::filesystem::absolute(folder / file);
    if (access(path.c_str(), R_OK) != 0) {
      throw core::MissingError(path.string() + ": security document of " + participant +
                               " is missing or may not be read; deploy/security/make makes them");
    }
    add(name, "file://" + path.string());
  };
  add("dds.sec.auth.plugin", "builtin.PKI-DH");
  add_file("dds.sec.auth.builtin.PKI-DH.identity_ca", "identity_ca.pem");
  add_file("dds.sec.auth.builtin.PKI-DH.identity_certificate", own / "identity.pem");
  add_file("dds.sec.auth.builtin.PKI-DH.private_key", own / "key.pem");
  add("dds.sec.access.plugin", "builtin.Access-Permissions");
  add_file("dds.sec.access.builtin.Access-Permissions.permissions_ca", "permissions_ca.pem");
  add_file("dds.sec.access.builtin.Access-Permissions.governance", "governance.p7s");
  add_file("dds.sec.access.builtin.Access-Permissions.permissions", own / "permissions.p7s");
  add("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  return properties;
}

}  // namespace phantom::dds
