#include "components/phantom_session/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/runtime/configuration/fields.hpp"

namespace phantom::phantom_session {
namespace {

runtime::Deployment two_hosts() {
  runtime::Deployment deployment;
  deployment.file = "t.yaml";
  deployment.network.domain = 9;
  deployment.hosts = {
      {"master",
       {{.component = "master_io",
         .name = "master_io",
         .config = "own.yaml",
         .arguments = {"--log-level", "debug"}}}},
      {"view", {{.component = "synthetic_viewer", .name = "viewer", .arguments = {}, .nice = 10}}}};
  return deployment;
}

TEST(Plan, GivesEachProcessTheCommonOptionsThenItsOwn) {
  const SessionRequest request{.master_options = {"--operator", "constant_velocity"}};
  const auto planned = plan(two_hosts(), {.host = "master"}, request);
  ASSERT_EQ(planned.size(), 1u);
  EXPECT_THAT(planned[0].arguments, testing::IsSupersetOf({"--deployment", "t.yaml", "--domain", "9",
                                                           "--host", "master", "--operator"}));
  // Its entry in the topology it reads itself.
  EXPECT_THAT(planned[0].arguments, testing::Not(testing::Contains("own.yaml")));
  EXPECT_THAT(planned[0].arguments, testing::Not(testing::Contains("--log-level")));
  EXPECT_EQ(planned[0].arguments.back(), "constant_velocity");
  EXPECT_THAT(plan(two_hosts(), {.host = "view"}, request)[0].arguments,
              testing::AllOf(testing::Not(testing::Contains("--operator")),
                             testing::IsSupersetOf({"--name", "viewer"})));
}

TEST(Plan, TheViewerGetsTheFolderOfThePagesSecrets) {
  const SessionRequest request{.page_secrets = "/run/secrets"};
  EXPECT_THAT(plan(two_hosts(), {.host = "view"}, request)[0].arguments,
              testing::IsSupersetOf({"--page-secrets", "/run/secrets"}));
  for (const auto& [host, given] : {std::pair{"master", request}, std::pair{"view", SessionRequest()}})
    EXPECT_THAT(plan(two_hosts(), {.host = host}, given)[0].arguments,
                testing::Not(testing::Contains("--page-secrets")));
}

// Tries phantom_session: a host that the topology lacks
TEST(Plan, AnUnknownHostIsNamedWithThoseThereAre) {
  EXPECT_THAT([] { plan(two_hosts(), {.host = "desk"}, {}); },
              testing::ThrowsMessage<runtime::ConfigError>(
                  "t.yaml: hosts: no host called 'desk'; allowed: master, view"));
}

TEST(Plan, TheHostThatTheDeploymentFoundIsMeantUnlessAnotherIsNamed) {
  auto deployment = two_hosts();
  EXPECT_THAT([&] { plan(deployment, {}, {}); },
              testing::ThrowsMessage<runtime::ConfigError>(
                  "t.yaml: hosts: say by --host which of them this is; allowed: master, view"));
  deployment.host = "view";
  EXPECT_EQ(plan(deployment, {}, {}).at(0).process.name, "viewer");
  EXPECT_EQ(plan(deployment, {.host = "master"}, {}).at(0).process.name, "master_io");
}

TEST(Config, ShippedIsValid) {
  EXPECT_NO_THROW(load_config(PHANTOM_SOURCE_DIR "/components/phantom_session/phantom_session.yaml"));
}

TEST(Plan, AComponentThatSomebodyElseRunsIsLeftOut) {
  runtime::ProcessOptions options;
  options.deployment = PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml";
  const auto deployment = runtime::load_deployment(options);
  const auto all = plan(deployment, options, {});
  const auto fewer = plan(deployment, options, {.without = {"master_io"}});
  EXPECT_EQ(fewer.size() + 1, all.size());
  for (const auto& planned : fewer) EXPECT_NE(planned.process.component, "master_io");
  EXPECT_THROW(plan(deployment, options, {.without = {"master"}}), runtime::ConfigError);
}

}  // namespace
}  // namespace phantom::phantom_session
