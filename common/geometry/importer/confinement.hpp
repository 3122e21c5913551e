#pragma once

namespace phantom::geometry {

/// From now on this process may read files and write to what is open; any other system call fails with EPERM:
/// no file is opened for writing, made, renamed or removed; no program is started, no process or thread; no
/// socket is made; nothing of another process is touched (seccomp, by libseccomp). Returns false if the
/// kernel refuses. With an address or thread sanitizer, which need more, it does nothing.
bool confine_this_process();

}  // namespace phantom::geometry
