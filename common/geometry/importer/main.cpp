// The importer that load_mesh() starts. It reads one mesh file under limits of its own and writes the result
// to its standard output. If a malformed file makes the reader crash, hang or exhaust memory, only this
// process is lost.
//   phantom_mesh_import FILE SCALE UP MAX_TRIANGLES MAX_CPU_S MAX_MEMORY_BYTES
// SCALE: metres per unit, or "-"; UP: y, z, or "-"; see MeshImportOptions. Exits with 2 if these are wrong.

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <new>
#include <string>
#include <string_view>

#include "common/geometry/importer/confinement.hpp"
#include "common/geometry/importer/importer.hpp"
#include "common/geometry/mesh/mesh_answer.hpp"

namespace phantom::geometry {
namespace {

template <class Number>
bool parse(std::string_view word, Number& number) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && end == word.data() + word.size();
}

bool parse_options(char** words, MeshImportOptions& options) {
  const std::string_view scale = words[2], up = words[3];
  if (scale != "-" && !parse(scale, options.scale.emplace())) return false;
  if (up != "-" && up != "y" && up != "z") return false;
  if (up != "-") options.y_up = up == "y";
  return parse(words[4], options.max_triangles) && parse(words[5], options.max_cpu_s) &&
         parse(words[6], options.max_memory_bytes);
}

void set_limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

/// Returns the address space in use, so that the limit counts only what the import adds.
[[maybe_unused]] std::uint64_t address_space_bytes() {
  unsigned long long pages = 0;
  if (FILE* statm = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(statm, "%llu", &pages) != 1) pages = 0;
    std::fclose(statm);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit_this_process(const MeshImportOptions& options) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // no import outlives the process that started it
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_FSIZE, 0);  // it writes to a pipe only
  set_limit(RLIMIT_CPU, static_cast<rlim_t>(options.max_cpu_s));
#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // sanitizers' shadow memory counts as address space
  set_limit(RLIMIT_AS, address_space_bytes() + options.max_memory_bytes);
#endif
  // The parent recognises a crash by its signal, so a sanitizer must not handle it.
  for (const int number : {SIGXCPU, SIGABRT, SIGSEGV, SIGBUS, SIGFPE}) std::signal(number, SIG_DFL);
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

bool import_and_send(const char* path, const MeshImportOptions& options, int to) {
  LoadedMesh mesh;
  std::string problem;
  bool read = false;
  try {
    read = detail::import_mesh(path, options, mesh, problem);
  } catch (const std::bad_alloc&) {
    problem = "needs more memory than the " + std::to_string(options.max_memory_bytes >> 20) + " MiB allowed";
  } catch (const std::exception& error) {
    problem = std::string("is not a readable mesh: ") + error.what();
  }
  const auto head = read ? detail::answer_head(mesh) : detail::refusal(problem);
  if (!write_all(to, head.data(), head.size())) return false;
  return !read ||
         (write_all(to, mesh.vertices_m.data(), mesh.vertices_m.size() * sizeof mesh.vertices_m[0]) &&
          write_all(to, mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]));
}

}  // namespace
}  // namespace phantom::geometry

int main(int count, char** words) {
  using namespace phantom::geometry;
  MeshImportOptions options;
  if (count != 7 || !parse_options(words, options)) {
    std::fprintf(stderr, "phantom_mesh_import FILE SCALE|- y|z|- MAX_TRIANGLES MAX_CPU_S MAX_MEMORY_BYTES\n");
    return 2;
  }
  limit_this_process(options);
  // Output that assimp prints must not become part of the answer.
  const int answer = dup(STDOUT_FILENO);
  const int nowhere = open("/dev/null", O_WRONLY);
  if (answer < 0 || nowhere < 0 || dup2(nowhere, STDOUT_FILENO) < 0) return 1;
  if (!confine_this_process()) return 1;
  const bool sent = import_and_send(words[1], options, answer);
  _exit(sent ? 0 : 1);  // no destructors: freeing the scene of a damaged file could crash
}
