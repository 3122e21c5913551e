#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace phantom::test {

/// A folder for the state of this process's children, removed at its end.
struct StateFolder {
  StateFolder()
      : path(std::filesystem::temp_directory_path() / ("phantom_state_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path);
    setenv("PHANTOM_STATE_DIR", path.c_str(), 1);
  }
  ~StateFolder() {
    std::error_code ignored;
    if (getpid() == owner) std::filesystem::remove_all(path, ignored);
  }
  const std::filesystem::path path;
  const pid_t owner = getpid();
};

/// A DDS domain that no other test process of this host uses while this one runs: 100 to 199. `which`: of
/// several that this process needs; the same number gives the same domain. A name in the kernel's table of
/// sockets is what claims it, so that it is given back however the process ends. What outlives the processes
/// that the test starts (a stop in force, $PHANTOM_STATE_DIR) is kept in a folder of the test's own, so that
/// no test finds another's. Not thread-safe.
inline int own_domain(std::size_t which = 0) {
  static const StateFolder state;
  constexpr int kFirst = 100, kDomains = 100;
  static std::vector<int> claimed;
  const int begin = static_cast<int>(getpid() % kDomains);
  for (int i = 0; claimed.size() <= which; ++i) {
    if (i == kDomains) throw std::runtime_error("other test processes have all DDS domains from 100 to 199");
    const int domain = kFirst + (begin + i) % kDomains;
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    const int length =
        std::snprintf(name.sun_path + 1, sizeof name.sun_path - 1, "phantom_test_domain_%d", domain);
    const auto size =
        static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + static_cast<std::size_t>(length));
    const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket >= 0 && bind(socket, reinterpret_cast<const sockaddr*>(&name), size) == 0) {
      claimed.push_back(domain);
    } else if (socket >= 0) {
      close(socket);
    }
  }
  return claimed[which];
}

}  // namespace phantom::test
