#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "common/geometry/mesh/mesh_io.hpp"
#include "components/wva_server/live/live_matter.hpp"

namespace phantom::wva_server {

/// The values of wva_server.yaml.
struct WvaServerConfig {
  geometry::MeshImportOptions mesh_import;  ///< limits only; scale and up axis belong to each object
  std::size_t mesh_chunk_bytes = 256 * 1024;
  double status_rate_hz = 2.0;
  bool accept_commands = true;
  std::string arm;                    ///< whose slave_state is received; empty: of the cell's only one
  bool automatic_grasp = true;        ///< what its gripper takes and lets go is attached and released
  double arm_staleness_s = 0.1;       ///< a slave_state that is older says nothing of where the arm is
  int threads = 0;                    ///< of an activation; at least 1 after loading
  std::uint64_t max_voxel_bytes = 0;  ///< above it commands add no more objects; above 0 after loading
  /// Limits for commands, besides mesh_import's.
  std::uint64_t command_steps = 1'000'000'000, command_mesh_bytes = std::uint64_t{1} << 30;
  std::uint32_t command_triangles = 500'000;
  std::size_t command_objects = 4096;
  int command_import_s = 10;
  LiveRules live;  ///< live matter's layers without a thickness: the cell's
};

extern const char* const kParameters;  ///< the parameter table: the shipped wva_server.yaml

/// Reads and checks a configuration. Throws runtime::ConfigError (file, line, key, value, what is allowed).
WvaServerConfig load_config(const std::filesystem::path& path);

}  // namespace phantom::wva_server
