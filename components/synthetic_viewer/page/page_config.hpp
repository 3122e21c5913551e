#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/configuration/role_secrets.hpp"

namespace phantom::web {
class TlsContext;
}  // namespace phantom::web

namespace phantom::synthetic_viewer {

/// How the operator's page is served; part of synthetic_viewer.yaml.
struct PageConfig {
  bool enabled = true;
  std::string address = "127.0.0.1";
  int port = 8080;      ///< 0: any free port
  int stream_port = 0;  ///< port of pictures and events; 0: any free port
  /// Further host names and addresses under which the page may be asked for.
  std::vector<std::string> host_names;
  std::optional<runtime::RoleSecrets> secrets;  ///< none: everybody may watch and command
  std::shared_ptr<const web::TlsContext> tls;   ///< none: HTTP without encryption
  bool allow_commands = true;                   ///< whether the page may send commands
  bool headset_hand = false;                    ///< whether a headset's controller may lead the arm
  double hand_silent_s = 0.1;                   ///< so long without its pose, and it does not any more
  double scene_Hz = 60.0;                       ///< greatest rate of the scene stream's poses
  int max_streams = 24;      ///< number of streams (pictures and events) at once, all pages together
  int max_connections = 64;  ///< on each port, whose request has not come yet
  int max_connections_per_address = 32;  ///< of these, from one address
};

}  // namespace phantom::synthetic_viewer
