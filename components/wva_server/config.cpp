#include "components/wva_server/config.hpp"

#include <unistd.h>

#include <algorithm>
#include <thread>

#include "common/runtime/fields.hpp"

namespace phantom::wva_server {
namespace {

constexpr double kKibibyte = 1 << 10, kMebibyte = 1 << 20;

std::uint64_t memory_of_the_machine() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
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
  file.number("max_voxels_mib", config.max_voxel_bytes, kMebibyte);
  file.number("threads", config.threads);
  file.finish();
  if (config.threads == 0)
    config.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (config.max_voxel_bytes == 0) config.max_voxel_bytes = memory_of_the_machine() / 2;
  return config;
}

}  // namespace phantom::wva_server
