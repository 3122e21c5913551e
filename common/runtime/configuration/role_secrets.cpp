#include "common/runtime/configuration/role_secrets.hpp"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"

namespace phantom::runtime {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSecretOctets = 16, kMinLength = 16, kMaxLength = 128;

std::string read_secret(const fs::path& file) {
  const auto fault = [&](const std::string& problem) {
    return core::ConfigError(file.string() + ": " + problem);
  };
  struct stat state {};
  if (stat(file.c_str(), &state) != 0)
    throw core::MissingError(file.string() + ": cannot be read: " + std::strerror(errno) +
                             "; a secret of the operator's page is expected");
  if (!S_ISREG(state.st_mode) || (state.st_mode & 077) != 0)
    throw fault("a secret must be a file of mode 0600, which its owner alone may read");
  std::ifstream in(file);
  std::string secret(kMaxLength + 2, '\0');
  in.read(secret.data(), static_cast<std::streamsize>(secret.size()));
  secret.resize(static_cast<std::size_t>(in.gcount()));
  if (secret.ends_with('\n')) secret.pop_back();
  bool readable = secret.size() >= kMinLength && secret.size() <= kMaxLength;
  for (const char c : secret) readable = readable && c > ' ' && c < 0x7F;
  if (!readable) throw fault("a secret has 16 to 128 visible ASCII characters in one line");
  return secret;
}

}  // namespace

bool same_secret(std::string_view secret, std::string_view given) {
  if (secret.empty()) return false;
  std::size_t difference = secret.size() ^ given.size();
  for (std::size_t i = 0; i < given.size(); ++i)
    difference |= static_cast<unsigned char>(secret[i < secret.size() ? i : 0] ^ given[i]);
  return difference == 0;
}

std::optional<Role> RoleSecrets::role_of(std::string_view secret) const {
  std::optional<Role> role;
  for (std::size_t i = 0; i < secrets_.size(); ++i)
    if (same_secret(secrets_[i], secret)) role = static_cast<Role>(i);
  return role;
}

std::string random_hex(std::size_t octets) {
  std::string random(octets, '\0'), text;
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(octets))
    throw core::MissingError("the kernel gives no random numbers");
  for (const char c : random) {
    constexpr const char* kDigits = "0123456789abcdef";
    text += kDigits[static_cast<unsigned char>(c) >> 4];
    text += kDigits[static_cast<unsigned char>(c) & 15];
  }
  return text;
}

void make_role_secrets(const fs::path& folder) {
  const auto fault = [](const fs::path& path) {
    return core::MissingError(path.string() + ": cannot be made: " + std::strerror(errno));
  };
  std::error_code problem;
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), problem);
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) throw fault(folder);
  for (const char* role : kRoleNames) {
    const fs::path file = folder / role;
    if (fs::exists(file)) continue;
    // Whole before it has its name: who starts at the same time reads it, or makes it, but never half of it.
    const fs::path whole = folder / ("." + std::string(role) + "." + random_hex(8));
    const int descriptor = open(whole.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (descriptor < 0) throw fault(whole);
    const std::string line = random_hex(kSecretOctets) + "\n";
    bool made = write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
    made = fsync(descriptor) == 0 && made;
    close(descriptor);
    made = made && (link(whole.c_str(), file.c_str()) == 0 || errno == EEXIST);
    // Without it a loss of power may leave a page whose secrets nobody has, as others are made then.
    made = made && core::sync_folder_of(file);
    const int why = errno;
    unlink(whole.c_str());
    errno = why;
    if (!made) throw fault(file);
  }
}

RoleSecrets load_role_secrets(const fs::path& folder) {
  std::array<std::string, kRoleNames.size()> secrets;
  for (std::size_t i = 0; i < secrets.size(); ++i) {
    secrets[i] = read_secret(folder / kRoleNames[i]);
    for (std::size_t other = 0; other < i; ++other)
      if (secrets[i] == secrets[other])
        throw core::ConfigError((folder / kRoleNames[i]).string() + ": is the secret of the role " +
                                kRoleNames[other] + ", too; each role must have its own");
  }
  return RoleSecrets(std::move(secrets));
}

}  // namespace phantom::runtime
