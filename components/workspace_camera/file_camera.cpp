#include "components/workspace_camera/file_camera.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>

#include "common/core/errors.hpp"
#include "common/fusion/point_projection.hpp"
#include "components/workspace_camera/cloud_file.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr std::uintmax_t kMaxFileOctets = std::uintmax_t{1} << 30;

core::Expected<std::vector<std::uint16_t>> image_of(const std::filesystem::path& file,
                                                    const FileOptions& options) {
  const auto wrong = [&](const std::string& why) {
    return core::Status::invalid_argument(file.string() + ": " + why);
  };
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  if (failed) return wrong(failed.message());
  if (size > kMaxFileOctets)
    return wrong(std::to_string(size) + " octets; allowed: at most " + std::to_string(kMaxFileOctets));
  std::ifstream stream(file, std::ios::binary);
  const std::string octets{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return wrong("cannot be read");
  auto points = read_cloud(octets);
  if (!points) return wrong(points.status().message());
  for (float& value : *points) value *= static_cast<float>(options.unit_m);
  return fusion::depths_of_points(*points, options.camera);
}

}  // namespace

FileCamera::FileCamera(FileOptions options) : options_(std::move(options)) {
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(options_.folder, failed)) {
    const auto extension = entry.path().extension();
    if (extension == ".pcd" || extension == ".ply") files_.push_back(entry.path());
  }
  if (failed) throw core::MissingError(options_.folder.string() + ": " + failed.message());
  if (files_.empty())
    throw core::ConfigError(options_.folder.string() + ": has no cloud; allowed: files *.pcd and *.ply");
  std::ranges::sort(files_);
  read_next();
}

void FileCamera::read_next() {
  if (next_ == files_.size() && options_.repeat) next_ = 0;
  if (next_ == files_.size()) return;
  reading_ = std::async(std::launch::async, image_of, files_[next_++], options_);
}

core::Expected<std::optional<std::vector<std::uint16_t>>> FileCamera::next() {
  if (at_end() || reading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return std::optional<std::vector<std::uint16_t>>();
  Image image = reading_.get();
  read_next();
  if (!image) return image.status();
  return std::optional(*std::move(image));
}

}  // namespace phantom::workspace_camera
