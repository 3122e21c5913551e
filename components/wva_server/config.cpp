#include "components/wva_server/config.hpp"

#include <unistd.h>

#include <algorithm>
#include <thread>

#include "common/runtime/config_reader.hpp"

namespace phantom::wva_server {
namespace {

std::uint64_t memory_of_the_machine() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

WvaServerConfig load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  WvaServerConfig config;
  const auto import = file.optional_section("mesh_import");
  config.mesh_import.max_cpu_s = import.integer("max_cpu_s", 60, {1, 3600, "s"});
  config.mesh_import.max_memory_bytes =
      static_cast<std::uint64_t>(import.integer("max_memory_mib", 4096, {64, 1048576, "MiB"})) << 20;
  config.mesh_import.max_triangles =
      static_cast<std::uint32_t>(import.integer("max_triangles", 20'000'000, {1, 100'000'000, "triangles"}));
  config.mesh_chunk_bytes =
      static_cast<std::size_t>(file.integer("mesh_chunk_kib", 256, {1, 256, "KiB"})) * 1024;
  config.status_rate_hz = file.number("status_rate_hz", 2.0, {1.0, 50.0, "Hz"});
  config.accept_commands = file.flag("accept_commands", true);
  config.threads = file.integer("threads", 0, {0, 256, ""});
  if (config.threads == 0)
    config.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  config.max_voxel_bytes = static_cast<std::uint64_t>(
                               file.integer("max_voxels_mib", 0, {0, 1 << 24, "MiB; 0: half the machine's"}))
                           << 20;
  if (config.max_voxel_bytes == 0) config.max_voxel_bytes = memory_of_the_machine() / 2;
  file.finish();
  return config;
}

}  // namespace phantom::wva_server
