#include "common/workspace/nrrd.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <sstream>
#include <vector>

namespace phantom::workspace {
namespace {

constexpr const char* kTypes[] = {"int8", "float", "uint16"};  // by NrrdField

std::string header(const GridSpec& grid, NrrdField field, NrrdEncoding encoding) {
  std::ostringstream text;
  text.precision(17);
  const Eigen::Vector3d& s = grid.voxel_size_m.sides_m();
  const Eigen::Vector3d first = grid.centre_of({0, 0, 0});
  text << "NRRD0005\n"
       << "# phantom workspace: z up, metres\n"
       << "type: " << kTypes[static_cast<std::size_t>(field)] << "\ndimension: 3\n"
       << "space: right-anterior-superior\n"
       << "sizes: " << grid.size_vox[0] << ' ' << grid.size_vox[1] << ' ' << grid.size_vox[2] << '\n'
       << "space directions: (" << s.x() << ",0,0) (0," << s.y() << ",0) (0,0," << s.z() << ")\n"
       << "space origin: (" << first.x() << ',' << first.y() << ',' << first.z() << ")\n"
       << "space units: \"m\" \"m\" \"m\"\n"
       << "kinds: domain domain domain\n"
       << "endian: little\n"
       << "encoding: " << (encoding == NrrdEncoding::kGzip ? "gzip" : "raw") << "\n\n";
  return text.str();
}

template <class T>
void append(std::vector<char>& bytes, T value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// One z slice of the field.
std::vector<char> slice(const Workspace& workspace, NrrdField field, std::int32_t z) {
  std::vector<char> bytes;
  const auto& size = workspace.grid().size_vox;
  bytes.reserve(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * sizeof(float));
  for (std::int32_t y = 0; y < size[1]; ++y) {
    for (std::int32_t x = 0; x < size[0]; ++x) {
      const Index3 v{x, y, z};
      if (field == NrrdField::kOrder) append(bytes, workspace.order(v));
      if (field == NrrdField::kMu) append(bytes, workspace.mu(v));
      if (field == NrrdField::kObject) append(bytes, workspace.object(v));
    }
  }
  return bytes;
}

}  // namespace

core::Status write_nrrd(const std::filesystem::path& path, const Workspace& workspace, NrrdField field,
                        NrrdEncoding encoding) {
  // A pipe or a device is written to directly. A file is written under another name and replaces the old one
  // only when it is complete.
  std::error_code ignored;
  const bool is_file =
      !std::filesystem::exists(path, ignored) || std::filesystem::is_regular_file(path, ignored);
  const std::filesystem::path draft = is_file ? path.string() + ".part" : path.string();
  const core::Status failed(core::ErrorCode::kUnavailable, path.string() + ": cannot be written");
  const int fd = ::open(draft.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  bool ok = fd >= 0 && ::dprintf(fd, "%s", header(workspace.grid(), field, encoding).c_str()) > 0;
  // zlib writes to the same file, in its transparent mode if nothing is to be compressed.
  const gzFile file = fd < 0 ? nullptr : gzdopen(fd, encoding == NrrdEncoding::kGzip ? "w1" : "wT");
  for (std::int32_t z = 0; ok && file != nullptr && z < workspace.grid().size_vox[2]; ++z) {
    const std::vector<char> bytes = slice(workspace, field, z);
    ok = gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())) == static_cast<int>(bytes.size());
  }
  if (file == nullptr || gzclose(file) != Z_OK || !ok) {
    if (fd >= 0 && file == nullptr) ::close(fd);
    if (is_file) std::filesystem::remove(draft, ignored);
    return failed;
  }
  if (!is_file) return core::Status::ok();
  std::error_code problem;
  std::filesystem::rename(draft, path, problem);
  if (problem) return failed;
  return core::Status::ok();
}

}  // namespace phantom::workspace
