#pragma once

#include <filesystem>
#include <vector>

namespace phantom::runtime {

/// Where the stops of the sides of this host are kept.
struct StopPlace {
  std::filesystem::path folder;
  bool shared = false;  ///< by all users of the host: who creates the folder makes it writable for all
  std::vector<std::filesystem::path> former;  ///< where earlier releases kept them; stops there are adopted
};

/// Returns the place for a process that was given `state_dir` (--state-dir; may be empty):
/// 1. `state_dir`; 2. $PHANTOM_STATE_DIR; 3. /var/lib/phantom/stops, where the packages are installed;
/// 4. /var/tmp/phantom, which all users share and which survives a restart of the host.
/// So without 1 and 2 there is one place on a host, whoever starts the process: a service, a user, another
/// user. A process that may not use it does not start (StopFile). Places 3 and 4 name as former places those
/// of earlier releases: $STATE_DIRECTORY, $XDG_STATE_HOME/phantom, ~/.local/state/phantom.
/// `root` stands before the paths of 3 and 4, for tests. Real-time safe: no.
StopPlace stop_place(const std::filesystem::path& state_dir, const std::filesystem::path& root = "/");

/// Creates the folder if there is none. A shared one gets mode 1777. Errors show when a file is created
/// there.
void make_stop_folder(const std::filesystem::path& folder, bool shared) noexcept;

}  // namespace phantom::runtime
