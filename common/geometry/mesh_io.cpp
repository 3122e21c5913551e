#include "common/geometry/mesh_io.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <string>
#include <string_view>

#include "common/core/clock.hpp"
#include "common/geometry/mesh_import.hpp"

namespace phantom::geometry {
namespace {

using core::ErrorCode;
using core::Status;

// What the child sends: this header, then a text (the problem, or the format's name and the notes, a line
// each), then mesh_bytes().
struct Header {
  std::uint32_t ok;
  std::uint32_t text_bytes;
  std::uint32_t vertices;
  std::uint32_t triangles;
  double scale;
  KnownFrom scale_from, up_from;
  UpAxis up;
};

Status error_of(const std::filesystem::path& path, ErrorCode code, const std::string& problem) {
  return {code, "mesh " + path.string() + ": " + problem};
}

bool write_all(int fd, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t done = write(fd, bytes, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes += done;
    size -= static_cast<std::size_t>(done);
  }
  return true;
}

void set_limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

/// Address space in use now, so that the limit counts only what the import adds.
[[maybe_unused]] std::uint64_t address_space_bytes() {
  unsigned long long pages = 0;
  if (FILE* statm = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(statm, "%llu", &pages) != 1) pages = 0;
    std::fclose(statm);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit_this_process(const MeshImportOptions& options) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // no import outlives who asked for it
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, static_cast<rlim_t>(options.max_cpu_s));
#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // their shadow memory counts as address space
  set_limit(RLIMIT_AS, address_space_bytes() + options.max_memory_bytes);
#endif
  // The importer's last words ("terminate called …") would stand beside our one clear message.
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
}

std::string text_lines(const LoadedMesh& mesh) {
  std::string text = mesh.format + '\n';
  for (const std::string& note : mesh.notes) text += note + '\n';
  return text;
}

void take_text_lines(std::string_view text, LoadedMesh& mesh) {
  bool first = true;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    if (first) {
      mesh.format = text.substr(0, end);
    } else {
      mesh.notes.emplace_back(text.substr(0, end));
    }
    first = false;
    text.remove_prefix(end + 1);
  }
}

/// The child: imports, sends the outcome, ends without running the parent's destructors.
[[noreturn]] void import_and_send(const std::filesystem::path& path, const MeshImportOptions& options,
                                  int fd) {
  limit_this_process(options);
  for (const int number : {SIGINT, SIGTERM, SIGXCPU, SIGABRT, SIGSEGV}) signal(number, SIG_DFL);
  LoadedMesh mesh;
  std::string problem;
  bool ok = false;
  try {
    ok = detail::import_mesh_unguarded(path, options, mesh, problem);
  } catch (const std::bad_alloc&) {
    problem = "needs more memory than the " + std::to_string(options.max_memory_bytes >> 20) + " MiB allowed";
  } catch (const std::exception& error) {
    problem = std::string("is not a readable mesh: ") + error.what();
  }
  const std::string text = ok ? text_lines(mesh) : problem;
  const Header header{ok ? 1U : 0U,
                      static_cast<std::uint32_t>(text.size()),
                      static_cast<std::uint32_t>(mesh.vertices_m.size()),
                      static_cast<std::uint32_t>(mesh.triangles.size()),
                      mesh.scale,
                      mesh.scale_from,
                      mesh.up_from,
                      mesh.up};
  bool sent = write_all(fd, &header, sizeof header) && write_all(fd, text.data(), text.size());
  if (ok) {
    sent = sent && write_all(fd, mesh.vertices_m.data(), mesh.vertices_m.size() * 12) &&
           write_all(fd, mesh.triangles.data(), mesh.triangles.size() * 12);
  }
  _exit(sent ? 0 : 1);
}

/// Everything that arrives until the other end closes; false if the deadline passes first.
bool read_until_closed(int fd, core::Nanoseconds deadline_ns, std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> block(1 << 16);
  for (;;) {
    const core::Nanoseconds left_ns = deadline_ns - core::monotonic_ns();
    if (left_ns <= 0) return false;
    pollfd wait{fd, POLLIN, 0};
    if (poll(&wait, 1, static_cast<int>(left_ns / core::kNsPerMillisecond) + 1) <= 0) continue;
    const ssize_t count = read(fd, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    bytes.insert(bytes.end(), block.begin(), block.begin() + count);
  }
}

core::Expected<LoadedMesh> outcome(const std::filesystem::path& path, const MeshImportOptions& options,
                                   const std::vector<std::uint8_t>& bytes, int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    const int number = WTERMSIG(wait_status);
    if (number == SIGXCPU || number == SIGKILL) {
      return error_of(path, ErrorCode::kResourceExhausted,
                      "was not read within " + std::to_string(options.max_cpu_s) + " s of processor time");
    }
    return error_of(path, ErrorCode::kInvalidArgument,
                    std::string("is malformed: the importer crashed on it (") + strsignal(number) + ")");
  }
  Header header{};
  if (bytes.size() < sizeof header)
    return error_of(path, ErrorCode::kInternal, "the importer ended without an answer");
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + sizeof header,
                              std::min<std::size_t>(bytes.size() - sizeof header, header.text_bytes));
  if (header.ok == 0) return error_of(path, ErrorCode::kInvalidArgument, std::string(text));
  LoadedMesh mesh;
  const std::size_t before = sizeof header + text.size();
  if (!mesh_from_bytes(bytes.data() + before, bytes.size() - before, header.vertices, header.triangles,
                       mesh)) {
    return error_of(path, ErrorCode::kInternal, "the importer's answer was cut short");
  }
  take_text_lines(text, mesh);
  mesh.scale = header.scale;
  mesh.scale_from = header.scale_from;
  mesh.up = header.up;
  mesh.up_from = header.up_from;
  return mesh;
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
  return Status::ok();
}

struct Importer {
  pid_t child = 0;
  int from_child = -1;  ///< what it sends; ends when it does
};

core::Expected<Importer> start_importer(const std::filesystem::path& path, const MeshImportOptions& options) {
  // Imports on several threads: no child may inherit the sending end of another's pipe, which would keep that
  // open.
  static std::mutex starting;
  const std::lock_guard lock(starting);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return error_of(path, ErrorCode::kUnavailable, std::strerror(errno));
  const pid_t child = fork();
  if (child < 0) {
    const std::string reason = std::strerror(errno);
    close(ends[0]);
    close(ends[1]);
    return error_of(path, ErrorCode::kUnavailable, "no process for the import: " + reason);
  }
  if (child == 0) {
    close(ends[0]);
    import_and_send(path, options, ends[1]);
  }
  close(ends[1]);
  return Importer{child, ends[0]};
}

}  // namespace

core::Expected<LoadedMesh> load_mesh(const std::filesystem::path& path, const MeshImportOptions& options) {
  if (Status checked = check_file(path, options); !checked) return checked;
  LoadedMesh mesh;
  std::string problem;
  if (const auto read = detail::import_small_binary_stl(path, options, mesh, problem)) {
    if (!*read) return error_of(path, ErrorCode::kInvalidArgument, problem);
    return mesh;
  }
  const auto importer = start_importer(path, options);
  if (!importer) return importer.status();
  std::vector<std::uint8_t> bytes;
  // A child that waits for something uses no processor time: a generous clock time ends it as well.
  const int most_s = 4 * options.max_cpu_s;
  const bool in_time =
      read_until_closed(importer->from_child, core::monotonic_ns() + core::from_seconds(most_s), bytes);
  if (!in_time) kill(importer->child, SIGKILL);
  close(importer->from_child);
  int wait_status = 0;
  while (waitpid(importer->child, &wait_status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time)
    return error_of(path, ErrorCode::kResourceExhausted,
                    "was not read within " + std::to_string(most_s) + " s");
  return outcome(path, options, bytes, wait_status);
}

}  // namespace phantom::geometry
