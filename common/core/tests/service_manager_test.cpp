#include "common/core/service_manager.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace phantom::core {
namespace {

// A service manager's end, as systemd listens: on a path, or in the abstract namespace ('@').
class Manager {
 public:
  explicit Manager(const std::string& name) : name_(name), socket_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name[0] == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0) << std::strerror(errno);
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }
  ~Manager() {
    unsetenv("NOTIFY_SOCKET");
    close(socket_);
    if (name_[0] != '@') unlink(name_.c_str());
  }
  std::string heard() {
    char text[1024];
    const auto size = recv(socket_, text, sizeof text, MSG_DONTWAIT);
    return size < 0 ? "nothing" : std::string(text, static_cast<std::size_t>(size));
  }

 private:
  std::string name_;
  int socket_;
};

TEST(ServiceManager, HearsThatTheProcessIsUpAliveAndWhatItDoes) {
  const std::string path = "/tmp/phantom_notify_" + std::to_string(getpid());
  for (const std::string& name : {path, "@" + path}) {
    Manager manager(name);
    notify_service_manager("ready: version 3\nWATCHDOG=trigger");
    EXPECT_EQ(manager.heard(), "READY=1\nWATCHDOG=1\nSTATUS=ready: version 3 WATCHDOG=trigger\n")
        << "a message of several lines sends no assignment of its own";
  }
}

TEST(ServiceManager, IsNotToldThatAProcessLivesOfWhichALoopHangs) {
  Manager manager("@phantom_notify_hung_" + std::to_string(getpid()));
  notify_service_manager("fault: the servo loop has not run for 3.2 s", false);
  EXPECT_EQ(manager.heard(), "READY=1\nSTATUS=fault: the servo loop has not run for 3.2 s\n");
}

TEST(ServiceManager, NeedsNone) {
  unsetenv("NOTIFY_SOCKET");
  notify_service_manager("ready");
  setenv("NOTIFY_SOCKET", "/nonexistent/socket", 1);
  notify_service_manager("ready");
  setenv("NOTIFY_SOCKET", std::string(300, 'x').c_str(), 1);
  notify_service_manager("ready");
  unsetenv("NOTIFY_SOCKET");
}

TEST(ServiceManager, NeverBlocksOnOneThatDoesNotListen) {
  Manager manager("@phantom_notify_full_" + std::to_string(getpid()));
  for (int i = 0; i < 2000; ++i) notify_service_manager("busy");  // more than a socket holds
  EXPECT_EQ(manager.heard().substr(0, 7), "READY=1");
}

}  // namespace
}  // namespace phantom::core
