#include "components/wva_server/config.hpp"

#include <algorithm>
#include <thread>

#include "common/core/host/host_memory.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::wva_server {
namespace {

constexpr double kKibibyte = 1 << 10, kMebibyte = 1 << 20;

void read_live(const runtime::Fields& live, LiveRules& rules) {
  live.text("source", rules.source);
  live.number("tolerance_vox", rules.tolerance_vox);
  live.number("min_voxels", rules.min_voxels);
  live.number("join_vox", rules.join_vox);
  live.numbers("thickness_vox", rules.profile.thickness_vox);
  std::vector<double> mu_Pa_s_per_m;
  live.numbers("mu_Pa_s_per_m", mu_Pa_s_per_m);
  rules.profile.mu_Pa_s_per_m.assign(mu_Pa_s_per_m.begin(), mu_Pa_s_per_m.end());
  live.number("mu_skin_Pa_s_per_m", rules.profile.mu_skin_Pa_s_per_m);
  live.check(rules.profile.thickness_vox.size() == rules.profile.mu_Pa_s_per_m.size(), "mu_Pa_s_per_m",
             "has not one value for each of thickness_vox; allowed: as many");
  if (!rules.profile.thickness_vox.empty())
    if (const auto checked = workspace::check_profile(rules.profile); !checked)
      throw live.error("thickness_vox", checked.message());
  live.choice("on_loss", rules.on_loss, {{"keep", OnLoss::kKeep}, {"end", OnLoss::kEnd}});
  live.number("silence_s", rules.silence_s);
}

}  // namespace

WvaServerConfig load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  WvaServerConfig config;
  const auto import = file.section("mesh_import");
  import.number("max_cpu_s", config.mesh_import.max_cpu_s);
  import.number("max_memory_mib", config.mesh_import.max_memory_bytes, kMebibyte);
  import.number("max_triangles", config.mesh_import.max_triangles);
  file.number("mesh_chunk_kib", config.mesh_chunk_bytes, kKibibyte);
  file.number("status_rate_hz", config.status_rate_hz);
  file.flag("accept_commands", config.accept_commands);
  file.text("arm", config.arm);
  file.flag("automatic_grasp", config.automatic_grasp);
  file.number("arm_staleness_s", config.arm_staleness_s);
  file.number("max_voxels_mib", config.max_voxel_bytes, kMebibyte);
  const auto commands = file.section("commands");
  commands.number("max_steps_millions", config.command_steps, 1e6);
  commands.number("max_triangles", config.command_triangles);
  commands.number("max_import_cpu_s", config.command_import_s);
  commands.number("max_meshes_mib", config.command_mesh_bytes, kMebibyte);
  commands.number("max_objects", config.command_objects);
  read_live(file.section("live"), config.live);
  file.number("threads", config.threads);
  file.finish();
  if (config.threads == 0)
    config.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (config.max_voxel_bytes == 0) config.max_voxel_bytes = core::memory_of_the_machine() / 2;
  return config;
}

}  // namespace phantom::wva_server
