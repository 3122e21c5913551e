#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <stdexcept>
#include <vector>

namespace phantom::test {

/// A DDS domain that no other test process of this host uses while this one runs: 100 to 199. `which`: of
/// several that this process needs; the same number gives the same domain. A name in the kernel's table of
/// sockets is what claims it, so that it is given back however the process ends. Not thread-safe.
inline int own_domain(std::size_t which = 0) {
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
