#include "common/workspace/nrrd.hpp"

#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

namespace phantom::workspace {
namespace {

const char* type_name(NrrdField field) {
  switch (field) {
    case NrrdField::kOrder:
      return "int8";
    case NrrdField::kMu:
      return "float";
    case NrrdField::kObject:
      return "uint16";
  }
  return "";
}

std::string header(const GridSpec& grid, NrrdField field, NrrdEncoding encoding) {
  std::ostringstream text;
  text.precision(17);
  const double s = grid.voxel_size_m;
  const Eigen::Vector3d first = grid.centre_of({0, 0, 0});
  text << "NRRD0005\n"
       << "# phantom workspace: z up, metres\n"
       << "type: " << type_name(field) << "\ndimension: 3\n"
       << "space: right-anterior-superior\n"
       << "sizes: " << grid.size_vox[0] << ' ' << grid.size_vox[1] << ' ' << grid.size_vox[2] << '\n'
       << "space directions: (" << s << ",0,0) (0," << s << ",0) (0,0," << s << ")\n"
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

/// Writes to a file, compressed by gzip if requested.
class Sink {
 public:
  Sink(std::ofstream& file, NrrdEncoding encoding) : file_(file), gzip_(encoding == NrrdEncoding::kGzip) {
    constexpr int kGzipWindow = 15 + 16;
    if (gzip_) ok_ = deflateInit2(&stream_, 1, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  }
  ~Sink() {
    if (gzip_) deflateEnd(&stream_);
  }
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  bool write(std::vector<char>& bytes, bool last) {
    if (!ok_) return false;
    if (!gzip_)
      return static_cast<bool>(file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())));
    stream_.next_in = reinterpret_cast<Bytef*>(bytes.data());
    stream_.avail_in = static_cast<uInt>(bytes.size());
    std::vector<char> packed(1 << 16);
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream_.avail_out = static_cast<uInt>(packed.size());
      if (deflate(&stream_, last ? Z_FINISH : Z_NO_FLUSH) == Z_STREAM_ERROR) return false;
      file_.write(packed.data(), static_cast<std::streamsize>(packed.size() - stream_.avail_out));
    } while (stream_.avail_out == 0);
    return static_cast<bool>(file_);
  }

 private:
  std::ofstream& file_;
  bool gzip_, ok_ = true;
  z_stream stream_{};
};

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
  {
    std::ofstream file(draft, std::ios::binary);
    file << header(workspace.grid(), field, encoding);
    Sink sink(file, encoding);
    const std::int32_t slices = workspace.grid().size_vox[2];
    bool ok = static_cast<bool>(file);
    for (std::int32_t z = 0; ok && z < slices; ++z) {
      std::vector<char> bytes = slice(workspace, field, z);
      ok = sink.write(bytes, z + 1 == slices);
    }
    file.close();
    if (!ok || !file) {
      if (is_file) std::filesystem::remove(draft, ignored);
      return failed;
    }
  }
  if (!is_file) return core::Status::ok();
  std::error_code problem;
  std::filesystem::rename(draft, path, problem);
  if (problem) return failed;
  return core::Status::ok();
}

}  // namespace phantom::workspace
