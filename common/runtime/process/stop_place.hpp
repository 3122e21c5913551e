#pragma once

#include <filesystem>
#include <vector>

namespace phantom::runtime {

/// Where the stops of the sides of this host are kept.
struct StopPlace {
  std::filesystem::path folder;
  bool shared = false;  ///< by all users of the host: who creates the folder makes it writable for all
  std::vector<std::filesystem::path> former;  ///< where earlier releases kept them; stops there are adopted
  std::filesystem::path host{};  ///< the host's one place, where `folder` is another by order; else empty
  bool host_shared = false;      ///< as `shared`, for `host`
};

/// Returns the place for a process that was given `state_dir` (--state-dir; may be empty). A host has one:
/// 1. $PHANTOM_STATE_DIR, by which an administrator decides for the host; 2. /var/lib/phantom/stops, where
/// the packages are installed; 3. /var/tmp/phantom, which all users share and which survives a restart of the
/// host. So it is the same for every service and user that starts the process. A process that may
/// not use it does not start (StopFile). With `state_dir` the process keeps its stops there, and the host's
/// place is `host`, which lists that folder, so that neither misses a stop in the other. Places 2 and 3 name
/// as former places those of earlier releases: $STATE_DIRECTORY, $XDG_STATE_HOME/phantom,
/// ~/.local/state/phantom. `root` stands before the paths of 2 and 3, for tests. Real-time safe: no.
StopPlace stop_place(const std::filesystem::path& state_dir, const std::filesystem::path& root = "/");

/// Creates the folder if there is none. A shared one gets mode 1777. Errors show when a file is created
/// there.
void make_stop_folder(const std::filesystem::path& folder, bool shared) noexcept;

}  // namespace phantom::runtime
