#include "common/runtime/configuration/role_secrets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "common/core/errors.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

fs::path new_secrets() {
  const fs::path folder = fs::path(test::new_file("x").string() + ".secrets") / "page";
  make_role_secrets(folder);
  return folder;
}

std::string secret(const fs::path& folder, const char* role) {
  std::string line;
  std::getline(std::ifstream(folder / role), line);
  return line;
}

std::string refused_secrets(const fs::path& folder) {
  try {
    load_role_secrets(folder);
  } catch (const std::runtime_error& problem) {
    return problem.what();
  }
  return "accepted";
}

TEST(RoleSecretFiles, AreMadeOnceForTheirOwnerAloneAndRead) {
  const fs::path folder = new_secrets();
  const std::string operate = secret(folder, "operate");
  EXPECT_EQ(operate.size(), 32U);
  make_role_secrets(folder);
  EXPECT_EQ(secret(folder, "operate"), operate);
  for (const char* role : kRoleNames) {
    struct stat state {};
    ASSERT_EQ(stat((folder / role).c_str(), &state), 0);
    EXPECT_EQ(state.st_mode & 07777, 0600U) << role;
  }
  const RoleSecrets secrets = load_role_secrets(folder);
  EXPECT_EQ(secrets.role_of(secret(folder, "watch")), Role::kWatch);
  EXPECT_EQ(secrets.role_of(operate), Role::kOperate);
  EXPECT_EQ(secrets.role_of(secret(folder, "configure")), Role::kConfigure);
  for (const std::string& wrong : {std::string(), operate + "0", operate.substr(1), std::string("operate")})
    EXPECT_FALSE(secrets.role_of(wrong)) << wrong;
}

TEST(RoleSecretFiles, AreTheSameForAllWhoStartAtOnce) {
  const fs::path above = fs::path(test::new_file("x").string() + ".many");
  for (int round = 0; round < 100; ++round) {
    const fs::path folder = above / std::to_string(round);
    std::array<std::string, 4> seen;
    std::atomic<int> ready{0};
    {
      std::vector<std::jthread> starting;
      for (std::string& one : seen) {
        starting.emplace_back([&] {
          ++ready;
          while (ready < static_cast<int>(seen.size())) std::this_thread::yield();
          try {
            make_role_secrets(folder);
            load_role_secrets(folder);  // throws if any is only half there
            for (const char* role : kRoleNames) one += secret(folder, role) + " ";
          } catch (const std::exception& problem) {
            one = problem.what();
          }
        });
      }
    }
    for (const std::string& one : seen) {
      ASSERT_EQ(one, seen[0]) << round;
      ASSERT_EQ(one.size(), kRoleNames.size() * 33) << one;
    }
    ASSERT_EQ(std::distance(fs::directory_iterator(folder), {}), 3) << "something else is left there";
  }
}

// Tries synthetic_viewer: a secret
// Tries synthetic_viewer: secrets that cannot be used
TEST(RoleSecretFiles, ThatAreNoSecretsAreRefused) {
  const fs::path folder = new_secrets();
  const auto write = [&](const std::string& text) { std::ofstream(folder / "operate") << text; };
  ASSERT_EQ(chmod((folder / "operate").c_str(), 0640), 0);
  EXPECT_THAT(refused_secrets(folder), HasSubstr("operate: a secret must be a file of mode 0600"));
  ASSERT_EQ(chmod((folder / "operate").c_str(), 0600), 0);
  for (const std::string& bad :
       {std::string(), std::string("short\n"), std::string(200, 'x'),
        std::string("two words of many characters"), std::string(20, 'x') + "\n\n"}) {
    write(bad);
    EXPECT_THAT(refused_secrets(folder), HasSubstr("16 to 128 visible")) << bad;
  }
  write(secret(folder, "watch") + "\n");
  EXPECT_THAT(refused_secrets(folder), HasSubstr("operate: is the secret of the role watch, too"));
  fs::remove(folder / "operate");
  EXPECT_THAT(refused_secrets(folder), HasSubstr("operate: cannot be read"));
  EXPECT_THROW(load_role_secrets(folder), core::MissingError);
}

}  // namespace
}  // namespace phantom::runtime
