#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace phantom::runtime {

/// What somebody may do on the operator's page; each role may what those before it may.
enum class Role { kWatch, kOperate, kConfigure };
inline constexpr std::array kRoleNames{"watch", "operate", "configure"};
inline std::string name_of(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

/// Returns whether a secret, not empty, has been given. Takes a time that depends on the length of what was
/// given alone.
bool same_secret(std::string_view secret, std::string_view given);

/// A secret per role.
class RoleSecrets {
 public:
  explicit RoleSecrets(std::array<std::string, kRoleNames.size()> secrets) : secrets_(std::move(secrets)) {}
  /// Returns the role that `secret` stands for. Compares in a time that tells nothing about the secrets.
  std::optional<Role> role_of(std::string_view secret) const;

 private:
  std::array<std::string, kRoleNames.size()> secrets_;
};

/// Returns `octets` random octets of the kernel, in hexadecimal. Throws core::MissingError.
std::string random_hex(std::size_t octets);

/// Makes the folder, of mode 0700, and in it for each role a file of its name, of mode 0600, with a random
/// secret of 128 bits. Leaves files that are there as they are, also those that another process makes at the
/// same time: all read the same secrets. Throws core::MissingError.
void make_role_secrets(const std::filesystem::path& folder);

/// Reads the files that make_role_secrets() has made. Throws core::MissingError with the file if one is not
/// there, core::ConfigError if it may be read by others than its owner, has fewer than 16 or more than 128
/// characters, or is that of another role.
RoleSecrets load_role_secrets(const std::filesystem::path& folder);

}  // namespace phantom::runtime
