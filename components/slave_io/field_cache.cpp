#include "components/slave_io/field_cache.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <span>

namespace phantom::slave_io {
namespace {

constexpr const char* kPrefix = "contact_field-";

// Identifies the executable: a newer program may build another field from the same bodies.
std::string executable() {
  std::error_code problem;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", problem);
  const auto size = std::filesystem::file_size(self, problem);
  const auto time = std::filesystem::last_write_time(self, problem);
  return fmt::format("{} {} {}", self.string(), size, time.time_since_epoch().count());
}

}  // namespace

std::string FieldCache::recipe(const workspace::GridSpec& grid,
                               const std::vector<voxelise::FieldBody>& bodies,
                               const voxelise::DistanceFieldOptions& options) {
  std::string text =
      fmt::format("executable {}\ngrid {:a} {:a} {:a} {:a} {} {} {}\nbands {:a} {:a}\n", executable(),
                  grid.origin_m.x(), grid.origin_m.y(), grid.origin_m.z(), grid.voxel_size_m,
                  grid.size_vox[0], grid.size_vox[1], grid.size_vox[2], options.outside_m, options.inside_m);
  for (const voxelise::FieldBody& body : bodies)
    text += fmt::format("body {} {:016x} {} {}\n", body.id, body.mesh_W.content_hash(),
                        body.mesh_W.vertices_m.size(), body.mesh_W.triangles.size());
  return text;
}

std::filesystem::path FieldCache::file_of(const std::string& recipe) const {
  return folder_ / fmt::format("{}{:016x}", kPrefix, std::hash<std::string>{}(recipe));
}

std::optional<voxelise::DistanceField> FieldCache::find(const std::string& recipe) const {
  const std::filesystem::path path = file_of(recipe);
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
  if (bytes.size() < recipe.size() || !std::equal(recipe.begin(), recipe.end(), bytes.begin()))
    return std::nullopt;
  const std::span content(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  auto field = voxelise::DistanceField::decode(content.subspan(recipe.size()));
  if (field) return *std::move(field);
  spdlog::warn("{}: {}; it is built anew", path.string(), field.status().message());
  return std::nullopt;
}

void FieldCache::keep(const std::string& recipe, const voxelise::DistanceField& field) const {
  try {
    std::filesystem::create_directories(folder_);
    const std::filesystem::path path = file_of(recipe);
    std::filesystem::path unfinished = path;
    unfinished += fmt::format(".{}", getpid());
    std::ofstream file(unfinished, std::ios::binary);
    const std::vector<std::uint8_t> frame = field.encode();
    file << recipe;
    file.write(reinterpret_cast<const char*>(frame.data()), static_cast<std::streamsize>(frame.size()));
    file.close();
    if (!file) {
      std::filesystem::remove(unfinished);
      throw std::runtime_error("cannot be written");
    }
    std::filesystem::rename(unfinished, path);
    remove_old();
  } catch (const std::exception& problem) {
    spdlog::warn("{}: the contact field is not kept, and the next start is slow: {}", folder_.string(),
                 problem.what());
  }
}

void FieldCache::remove_old() const {
  std::vector<std::filesystem::directory_entry> kept;
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    if (entry.path().filename().string().starts_with(kPrefix)) kept.push_back(entry);
  std::sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) {
    std::error_code gone;
    return a.last_write_time(gone) > b.last_write_time(gone);
  });
  std::error_code gone;
  for (std::size_t i = kMostKept; i < kept.size(); ++i) std::filesystem::remove(kept[i], gone);
}

}  // namespace phantom::slave_io
