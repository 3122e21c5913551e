#include "common/web/request_origin.hpp"

#include <gtest/gtest.h>

namespace phantom::web {
namespace {

RequestOrigin to(const std::string& host, const std::string& served = "127.0.0.1") {
  return {.hosts = {host}, .origin = {}, .fetch_site = {}, .served_address = served};
}

TEST(RequestHost, OwnNamesAndAddressesAreServed) {
  const OriginRule rule({"viewer.cell.example", "10.0.0.7", "fd00::7"}, "http");
  for (const char* host :
       {"127.0.0.1", "127.0.0.1:8080", "127.8.9.10:1", "localhost", "localhost:65535", "LocalHost:8080",
        "[::1]", "[::1]:8080", "[0:0:0:0:0:0:0:1]:8080", "viewer.cell.example", "VIEWER.cell.example:8080",
        "10.0.0.7:8080", "[fd00::7]:8080", "[FD00:0::7]"})
    EXPECT_TRUE(rule.host_of(to(host))) << host;
  EXPECT_TRUE(rule.host_of(to("192.0.2.5:8080", "192.0.2.5")));
  EXPECT_TRUE(rule.host_of(to("192.0.2.5:8080", "::ffff:192.0.2.5"))) << "by a socket for both families";
  EXPECT_TRUE(rule.host_of(to("[2001:db8::5]:8080", "2001:db8::5")));
}

TEST(RequestHost, HostileSpellingsAreNot) {
  const OriginRule rule({"viewer.cell.example", "10.0.0.7"}, "http");
  const std::vector<std::string> hostile{"",
                                         " ",
                                         ":",
                                         ":8080",
                                         ".",
                                         "..",
                                         "127.attacker.example",
                                         "127.attacker.example:8080",
                                         "127.0.0.1.evil",
                                         "127.0.0.1.evil:8080",
                                         "127.0.0.1.evil.example",
                                         "localhost.evil",
                                         "localhost.evil:8080",
                                         "evil.localhost",
                                         "notlocalhost",
                                         "localhostx",
                                         "xlocalhost",
                                         "2130706433",
                                         "2130706433:8080",
                                         "017700000001",
                                         "0x7f000001",
                                         "0x7f.0.0.1",
                                         "0177.0.0.1",
                                         "127.0.0.01",
                                         "127.1",
                                         "127.0.1",
                                         "127.0.0.0x1",
                                         "0127.0.0.1",
                                         "127.0.0.1.",
                                         "127.0.0.1.:8080",
                                         "localhost.",
                                         "localhost.:8080",
                                         "viewer.cell.example.",
                                         "xviewer.cell.example",
                                         "viewer.cell.example.evil",
                                         "user@127.0.0.1",
                                         "user:word@localhost:8080",
                                         "127.0.0.1@evil.example",
                                         "localhost#@evil.example",
                                         "localhost/",
                                         "http://localhost",
                                         "localhost:",
                                         "localhost:0",
                                         "localhost:08080",
                                         "localhost:65536",
                                         "localhost:99999999999999999999",
                                         "localhost:80x",
                                         "localhost:8080:8080",
                                         "localhost: 8080",
                                         " localhost",
                                         "localhost ",
                                         "local host",
                                         "localhost,localhost",
                                         "localhost\t",
                                         "::1",
                                         "::1:8080",
                                         "[::1",
                                         "[::1]x",
                                         "[::1]8080",
                                         "[::1]:",
                                         "[::1]:0",
                                         "[]",
                                         "[]:8080",
                                         "[::1].evil",
                                         "[::1%lo]",
                                         "[::ffff:127.0.0.1]",
                                         "[::ffff:7f00:1]:8080",
                                         "[::127.0.0.1]",
                                         "[127.0.0.1]",
                                         "[localhost]",
                                         "[::2]",
                                         "256.0.0.1",
                                         "127.0.0.256",
                                         "126.255.255.255",
                                         "128.0.0.1",
                                         "0.0.0.0",
                                         "[::]",
                                         "10.0.0.8",
                                         "192.0.2.5",
                                         "\xE2\x91\xA0"
                                         "27.0.0.1",
                                         "127\xE3\x80\x82"
                                         "0.0.1",
                                         std::string("localhost\0", 10),
                                         std::string("127.0.0.1\0.evil", 15),
                                         std::string(300, 'a'),
                                         "evil.example"};
  for (const std::string& host : hostile) EXPECT_FALSE(rule.host_of(to(host))) << '"' << host << '"';
}

TEST(RequestHost, ExactlyOneHostHeaderIsTaken) {
  const OriginRule rule({}, "http");
  RequestOrigin request = to("localhost:8080");
  EXPECT_TRUE(rule.host_of(request));
  request.hosts.push_back("localhost:8080");
  EXPECT_FALSE(rule.host_of(request));
  request.hosts = {"localhost:8080", "evil.example"};
  EXPECT_FALSE(rule.host_of(request));
  request.hosts.clear();
  EXPECT_FALSE(rule.host_of(request));
}

TEST(RequestOrigin, CommandsAreTakenFromThePageItselfOnly) {
  const OriginRule rule({"viewer.cell.example"}, "http");
  struct Case {
    const char* host;
    std::optional<std::string> origin, site;
    bool taken;
  };
  const std::vector<Case> cases{
      {"localhost:8080", {}, {}, true},
      {"localhost:8080", "http://localhost:8080", {}, true},
      {"localhost:8080", "http://LOCALHOST:8080", "same-origin", true},
      {"[::1]:8080", "http://[::1]:8080", "same-origin", true},
      {"viewer.cell.example", "http://viewer.cell.example", "same-origin", true},
      {"localhost:8080", "http://localhost:8081", "same-site", false},
      {"localhost:8080", "http://localhost", {}, false},
      {"localhost:8080", "https://localhost:8080", {}, false},
      {"localhost:8080", "http://127.0.0.1:8080", {}, false},
      {"localhost:8080", "http://localhost:8080/", {}, false},
      {"localhost:8080", "http://localhost:8080.evil", {}, false},
      {"localhost:8080", "http://evil@localhost:8080", {}, false},
      {"localhost:8080", "http://localhost:8080 http://evil.example", {}, false},
      {"localhost:8080", "null", {}, false},
      {"localhost:8080", "", {}, false},
      {"localhost:8080", "http://evil.example", "cross-site", false},
      {"localhost:8080", {}, "cross-site", false},
      {"localhost:8080", {}, "same-site", false},
      {"localhost:8080", {}, "none", false},
      {"localhost:8080", {}, "", false},
      {"127.attacker.example:8080", "http://127.attacker.example:8080", "same-origin", false},
  };
  for (const Case& one : cases) {
    RequestOrigin request = to(one.host);
    request.origin = one.origin;
    request.fetch_site = one.site;
    EXPECT_EQ(rule.command_refusal(request).empty(), one.taken)
        << one.host << ", Origin " << one.origin.value_or("-") << ", site " << one.site.value_or("-");
  }
}

TEST(RequestOrigin, PagesFromElsewhereDoNotReadAndDoNotEmbed) {
  const OriginRule rule({}, "http");
  const Authority page = *parse_authority("localhost:8080");
  const auto refused = [&](std::optional<std::string> origin, std::optional<std::string> site,
                           bool embedded) {
    RequestOrigin request = to("localhost:8081");
    request.origin = std::move(origin);
    request.fetch_site = std::move(site);
    return !rule.read_refusal(request, page, embedded).empty();
  };
  EXPECT_FALSE(refused({}, {}, true));
  EXPECT_FALSE(refused("http://localhost:8080", "same-site", true)) << "streams have their own port";
  EXPECT_TRUE(refused("http://localhost:9000", "same-site", true));
  EXPECT_TRUE(refused({}, "same-site", true)) << "a picture in a page on another port of this host";
  EXPECT_FALSE(refused({}, "same-origin", true));
  EXPECT_FALSE(refused({}, "none", true)) << "opened by hand";
  EXPECT_TRUE(refused({}, "cross-site", true)) << "a picture in a page from elsewhere";
  EXPECT_FALSE(refused({}, "cross-site", false)) << "a link from elsewhere to the page";
  EXPECT_TRUE(!rule.read_refusal(to("127.attacker.example"), page, false).empty());
}

}  // namespace
}  // namespace phantom::web
