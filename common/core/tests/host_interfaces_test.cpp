#include "common/core/host/host_interfaces.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"

namespace phantom::core {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

const std::vector<HostInterface> kHost{
    {"lo", "127.0.0.1", true}, {"eth0", "10.30.1.2", false}, {"eth1", "10.30.1.3", true}};

NetworkOptions wanting(std::vector<std::string> interfaces) {
  NetworkOptions network;
  network.interfaces = std::move(interfaces);
  network.interfaces_place = "site.yaml:7: network.interfaces";
  return network;
}

TEST(HostInterfaces, ThoseThatRunAreAccepted) {
  EXPECT_NO_THROW(require_interfaces(wanting({}), kHost));
  EXPECT_NO_THROW(require_interfaces(wanting({"10.30.1.3", "127.0.0.1"}), kHost));
}

TEST(HostInterfaces, AnAddressThatThisHostHasNotIsNamedWithThoseItHas) {
  EXPECT_THAT(
      [] {
        require_interfaces(wanting({"10.30.1.3", "10.30.9.9"}), kHost);
      },
      ThrowsMessage<MissingError>(
          AllOf(HasSubstr("site.yaml:7: network.interfaces: 10.30.9.9 is no address of this host"),
                HasSubstr("127.0.0.1 (lo), 10.30.1.2 (eth0, not running), 10.30.1.3 (eth1)"))));
  EXPECT_THAT([] { require_interfaces(wanting({"127.0.0.1"}), {}); },
              ThrowsMessage<MissingError>(HasSubstr("which has no address")));
}

TEST(HostInterfaces, AnInterfaceWithoutALinkIsNamedWithWhatToDo) {
  EXPECT_THAT([] { require_interfaces(wanting({"10.30.1.2"}), kHost); },
              ThrowsMessage<MissingError>(AllOf(HasSubstr("interface eth0 is down or without a link"),
                                                HasSubstr("ip link set eth0 up"))));
}

TEST(HostInterfaces, EveryHostThatTestsRunOnHasALoopback) {
  EXPECT_NO_THROW(require_interfaces(wanting({"127.0.0.1"}), host_interfaces()));
}

}  // namespace
}  // namespace phantom::core
