#include "common/geometry/mesh/mesh_io.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>

#include "common/core/clock.hpp"
#include "common/geometry/mesh/mesh_answer.hpp"
#include "common/geometry/mesh/mesh_import.hpp"
#include "common/geometry/mesh/stand_in.hpp"

namespace phantom::geometry {
namespace {

using core::ErrorCode;
using core::Status;

Status error_of(const std::filesystem::path& path, ErrorCode code, const std::string& problem) {
  return {code, "mesh " + path.string() + ": " + problem};
}

Status check_file(const std::filesystem::path& path, const MeshImportOptions& options) {
  std::error_code problem;
  if (!std::filesystem::exists(path, problem))
    return error_of(path, ErrorCode::kNotFound, "there is no such file");
  if (!std::filesystem::is_regular_file(path, problem)) {
    return error_of(path, ErrorCode::kInvalidArgument, "is not a regular file");
  }
  const auto size = std::filesystem::file_size(path, problem);
  if (problem) return error_of(path, ErrorCode::kInvalidArgument, "cannot be read: " + problem.message());
  if (size == 0) return error_of(path, ErrorCode::kInvalidArgument, "is empty");
  if (size > options.max_file_bytes) {
    return error_of(path, ErrorCode::kResourceExhausted,
                    "has " + std::to_string(size >> 20) + " MiB; allowed: at most " +
                        std::to_string(options.max_file_bytes >> 20) + " MiB");
  }
  if (access(path.c_str(), R_OK) != 0) {
    return error_of(path, ErrorCode::kInvalidArgument,
                    std::string("cannot be read: ") + std::strerror(errno));
  }
  if (const std::string other = stand_in_at(path); !other.empty())
    return error_of(path, ErrorCode::kInvalidArgument, other);
  return Status::ok();
}

/// Returns the path of the importer: in the running executable's prefix, or as PHANTOM_MESH_IMPORT says.
std::filesystem::path importer_path() {
  if (const char* given = std::getenv("PHANTOM_MESH_IMPORT")) return given;
  std::error_code problem;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", problem);
  return self.parent_path().parent_path() / "libexec" / "phantom" / "phantom_mesh_import";
}

std::string number_text(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// Returns the importer's command line, as importer/main.cpp reads it.
std::vector<std::string> importer_words(const std::filesystem::path& importer,
                                        const std::filesystem::path& path, const MeshImportOptions& options) {
  return {importer.string(),
          path.string(),
          options.scale ? number_text(*options.scale) : "-",
          !options.y_up   ? "-"
          : *options.y_up ? "y"
                          : "z",
          std::to_string(options.max_triangles),
          std::to_string(options.max_cpu_s),
          std::to_string(options.max_memory_bytes)};
}

struct ImporterProcess {
  pid_t id = 0;
  int answer = -1;  ///< read end of the pipe from its standard output
};

/// Starts the importer. Uses posix_spawn rather than fork, because other threads of this process may hold
/// locks.
core::Expected<ImporterProcess> start_importer(const std::filesystem::path& path,
                                               const MeshImportOptions& options) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return error_of(path, ErrorCode::kUnavailable, std::strerror(errno));
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  // The importer's own error output ("terminate called …") would only obscure our message.
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const std::filesystem::path importer = importer_path();
  std::vector<std::string> words = importer_words(importer, path, options);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ImporterProcess process{0, ends[0]};
  const int problem =
      posix_spawn(&process.id, importer.c_str(), &files, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(ends[1]);
  if (problem == 0) return process;
  close(ends[0]);
  return error_of(path, ErrorCode::kUnavailable,
                  "the importer " + importer.string() + " does not start: " + std::strerror(problem) +
                      "; PHANTOM_MESH_IMPORT can name another place");
}

enum class ReadEnd { kClosed, kLate, kTooLong, kStopped };

/// Reads until the other end closes, the deadline passes, more than `most` bytes arrived, or keep_going()
/// returns false.
ReadEnd read_answer(int fd, core::Nanoseconds deadline_ns, std::size_t most,
                    const std::function<bool()>& keep_going, std::vector<std::uint8_t>& bytes) {
  constexpr int kLook_ms = 100;
  std::vector<std::uint8_t> block(1 << 16);
  while (bytes.size() <= most) {
    const core::Nanoseconds left_ns = deadline_ns - core::monotonic_ns();
    if (left_ns <= 0) return ReadEnd::kLate;
    if (keep_going && !keep_going()) return ReadEnd::kStopped;
    pollfd wait{fd, POLLIN, 0};
    const auto left_ms = static_cast<int>(left_ns / core::kNsPerMillisecond) + 1;
    if (poll(&wait, 1, keep_going ? std::min(kLook_ms, left_ms) : left_ms) <= 0) continue;
    const ssize_t count = read(fd, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return ReadEnd::kClosed;
    bytes.insert(bytes.end(), block.begin(), block.begin() + count);
  }
  return ReadEnd::kTooLong;
}

/// Kills the process if it still runs. Returns its wait status.
int end_of(const ImporterProcess& process) {
  close(process.answer);
  kill(process.id, SIGKILL);
  int wait_status = 0;
  while (waitpid(process.id, &wait_status, 0) < 0 && errno == EINTR) {
  }
  return wait_status;
}

core::Expected<LoadedMesh> import_by_process(const std::filesystem::path& path,
                                             const MeshImportOptions& options) {
  const auto process = start_importer(path, options);
  if (!process) return process.status();
  // A process that waits uses no processor time: a generous wall-clock limit ends it as well.
  const int most_s = 4 * options.max_cpu_s;
  std::vector<std::uint8_t> bytes;
  const ReadEnd read = read_answer(process->answer, core::monotonic_ns() + core::from_seconds(most_s),
                                   detail::max_answer_bytes(options), options.keep_going, bytes);
  const int ended = end_of(*process);
  const auto not_within = [&](int seconds, const char* what) {
    return error_of(path, ErrorCode::kResourceExhausted,
                    "was not read within " + std::to_string(seconds) + " s" + what);
  };
  if (read == ReadEnd::kStopped) return error_of(path, ErrorCode::kUnavailable, "reading it was stopped");
  if (read == ReadEnd::kLate) return not_within(most_s, "");
  if (read == ReadEnd::kTooLong)
    return error_of(path, ErrorCode::kInternal, "the importer's answer is longer than the limits allow");
  if (WIFSIGNALED(ended)) {
    const int number = WTERMSIG(ended);
    if (number == SIGXCPU || number == SIGKILL) return not_within(options.max_cpu_s, " of processor time");
    return error_of(path, ErrorCode::kInvalidArgument,
                    std::string("is malformed: the importer crashed on it (") + strsignal(number) + ")");
  }
  auto mesh = detail::mesh_of_answer(bytes, options);
  if (!mesh) return error_of(path, mesh.status().code(), mesh.status().message());
  return mesh;
}

}  // namespace

core::Expected<LoadedMesh> load_mesh(const std::filesystem::path& path, const MeshImportOptions& options) {
  if (Status checked = check_file(path, options); !checked) return checked;
  constexpr std::uint64_t kMaxHere = 1'000'000, kBytesEach = 256;  // triangles; memory per triangle
  LoadedMesh mesh;
  std::string problem;
  const auto read = detail::import_binary_stl(
      path, options, std::min(kMaxHere, options.max_memory_bytes / kBytesEach), mesh, problem);
  if (!read) return import_by_process(path, options);
  if (!*read) return error_of(path, ErrorCode::kInvalidArgument, problem);
  return mesh;
}

}  // namespace phantom::geometry
