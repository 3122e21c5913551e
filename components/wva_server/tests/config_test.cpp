#include "components/wva_server/config.hpp"

#include <gmock/gmock.h>

#include "common/runtime/configuration/fields.hpp"
#include "components/wva_server/service.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::HasSubstr;

class Config : public TestCell {
 protected:
  void expect_refused(const std::string& yaml, const std::vector<std::string>& told) const {
    try {
      load_config(write("odd.yaml", yaml));
      FAIL() << "accepted: " << yaml;
    } catch (const runtime::ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr("odd.yaml:"));
      for (const auto& part : told) EXPECT_THAT(error.what(), HasSubstr(part));
    }
  }
};

TEST_F(Config, TheSourceOfLiveMatterIsACameraOfTheTopologyIfThatListsProcesses) {
  const auto problem = [&](const std::string& source, const std::string& hosts) -> std::string {
    runtime::ProcessOptions options;
    options.component = "wva_server";
    options.deployment =
        write("topology.yaml", "name: x\ndomain: 5\nqos_profiles: q.xml\ncell: c.yaml\n" + hosts);
    const auto config = load_config(write("live.yaml", "live: {source: \"" + source + "\"}"));
    try {
      check_live_source(config, "live.yaml", runtime::load_deployment(options));
    } catch (const runtime::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const std::string hosts =
      "hosts: [{name: here, processes: [{component: wva_server}, {component: workspace_camera, name: eyes}]}]\n";
  EXPECT_EQ(problem("eyes", hosts), "");
  EXPECT_EQ(problem("", hosts), "");
  EXPECT_EQ(problem("any", ""), "");
  EXPECT_THAT(problem("eye", hosts), HasSubstr("live.yaml: live.source: "));
  EXPECT_THAT(problem("eye", hosts), HasSubstr("has no workspace_camera called 'eye'; allowed: eyes"));
  EXPECT_THAT(problem("wva_server", hosts), HasSubstr("allowed: eyes"));
}

TEST_F(Config, TheShippedFileIsValidAndSaysTheDefaults) {
  const auto shipped = load_config(PHANTOM_SOURCE_DIR "/components/wva_server/wva_server.yaml");
  const auto defaults = load_config(write("empty.yaml", "{}"));
  EXPECT_EQ(shipped.mesh_chunk_bytes, 262144U);
  EXPECT_EQ(shipped.mesh_chunk_bytes, defaults.mesh_chunk_bytes);
  EXPECT_EQ(shipped.mesh_import.max_cpu_s, defaults.mesh_import.max_cpu_s);
  EXPECT_EQ(shipped.mesh_import.max_memory_bytes, defaults.mesh_import.max_memory_bytes);
  EXPECT_EQ(shipped.mesh_import.max_triangles, defaults.mesh_import.max_triangles);
  EXPECT_EQ(shipped.status_rate_hz, defaults.status_rate_hz);
  EXPECT_TRUE(shipped.accept_commands && defaults.accept_commands);
  EXPECT_GE(shipped.threads, 1);
  EXPECT_EQ(shipped.max_voxel_bytes, defaults.max_voxel_bytes);
  EXPECT_GT(shipped.max_voxel_bytes, 64U << 20);
  EXPECT_EQ(load_config(write("small.yaml", "max_voxels_mib: 3")).max_voxel_bytes, 3U << 20);
}

TEST_F(Config, AnUnknownKey) { expect_refused("mesh_chunk_kb: 3", {"mesh_chunk_kb", "mesh_chunk_kib"}); }
TEST_F(Config, AMethodThatIsNotThere) { expect_refused("method: dilation", {"method"}); }
TEST_F(Config, ChunksThatAreTooLarge) {
  expect_refused("mesh_chunk_kib: 512", {"mesh_chunk_kib", "512", "256"});
}
TEST_F(Config, AStatusRateBelowTheTopicsDeadline) {
  expect_refused("status_rate_hz: 0.1", {"status_rate_hz", "0.1", "1"});
}
TEST_F(Config, NoMemoryForImports) {
  expect_refused("mesh_import: {max_memory_mib: 1}", {"max_memory_mib", "64"});
}
TEST_F(Config, NoTimeForImports) { expect_refused("mesh_import: {max_cpu_s: 0}", {"max_cpu_s"}); }
TEST_F(Config, NoTriangles) { expect_refused("mesh_import: {max_triangles: 0}", {"max_triangles"}); }

}  // namespace
}  // namespace phantom::wva_server
